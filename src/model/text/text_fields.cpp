#include "wienertree/model/text/text_fields.hpp"

#include <algorithm>
#include <cassert>

#include "wienertree/model/text/affine_form.hpp"
#include "wienertree/model/text/bounded_states.hpp"

namespace wienertree::text {

namespace {

using Value = TapeBuilder::Value;

}  // namespace

PatternTapes::PatternTapes(std::size_t inputs, std::size_t fields, const Terms& terms)
    : fields_(fields), every_set_(fields <= 4) {
  const auto add = [&](const std::vector<bool>& used) {
    TapeBuilder builder(inputs, fields);
    const std::vector<Value> outputs = terms(builder, used);
    tapes_.push_back(builder.finish(outputs));
  };
  if (every_set_) {
    for (std::size_t set = 0; set < std::size_t{1} << fields; ++set) {
      std::vector<bool> used(fields);
      for (std::size_t k = 0; k < fields; ++k) used[k] = (set >> k & 1U) != 0;
      add(used);
    }
    return;
  }
  for (std::size_t k = 0; k < fields; ++k) {
    std::vector<bool> used(fields, false);
    used[k] = true;
    add(used);
  }
  add(std::vector<bool>(fields, true));
}

const Tape& PatternTapes::of(std::span<const double> D) const {
  assert(D.size() == fields_);
  std::size_t set = 0, count = 0, last = 0;
  for (std::size_t k = 0; k < D.size(); ++k) {
    if (D[k] == 0) continue;
    if (every_set_) set |= std::size_t{1} << k;
    ++count;
    last = k;
  }
  if (every_set_) return tapes_[set];
  return tapes_[count == 1 ? last : fields_];
}

// out component i = output i of the tape.
void TextFields::run(const Tape& tape, ConstBatchView x, ConstBatchView more,
                     std::span<const double> uniforms, BatchView out) const {
  assert(out.components() == tape.outputs() && out.nodes() == x.nodes());
  thread_local std::vector<const double*> inputs;
  thread_local std::vector<double*> outputs;
  inputs.clear();
  outputs.clear();
  for (std::size_t i = 0; i < x.components(); ++i) inputs.push_back(x.component(i).data());
  for (std::size_t i = 0; i < more.components(); ++i) inputs.push_back(more.component(i).data());
  if (inputs_) inputs_->append(x.component(d_ - 1), inputs);
  for (std::size_t i = 0; i < out.components(); ++i) outputs.push_back(out.component(i).data());
  tape.evaluate(inputs, uniforms, outputs, x.nodes());
}

TextFields::TextFields(const FieldExpressions& bound, const std::vector<StateBound>& bounds,
                       std::shared_ptr<const InputFunctions> known)
    : d_(bound.d), p_(bound.p), k_(bound.sensor.size()), inputs_(std::move(known)) {
  const std::size_t columns = inputs_ ? inputs_->columns() : 0;
  for (std::size_t i = 0; i < d_; ++i)
    if (bounds[i].bounded() && bounds[i].boundary == Boundary::absorb) absorbing_.push_back({i, bounds[i]});
  const auto sum_over_fields = [&](const std::vector<std::vector<Expression>>& coefficients, auto&& factor) {
    return [&coefficients, factor, &bounds, this](TapeBuilder& builder, const std::vector<bool>& used) {
      const BoundedStates states(bounds, builder, inputs_.get(), d_);
      std::vector<Value> outputs;
      for (std::size_t entry = 0; entry < coefficients.front().size(); ++entry) {
        Value sum = builder.constant(0);
        for (std::size_t k = 0; k <= p_; ++k)
          if (used[k])
            sum = builder.binary(Op::add, sum,
                                 builder.binary(Op::multiply, builder.uniform(k),
                                                emit(coefficients[k][entry], states.symbols(), builder)));
        outputs.push_back(factor(builder, states, entry, sum));
      }
      return outputs;
    };
  };
  direct_ = PatternTapes(d_ + columns, 1 + p_,
                         sum_over_fields(bound.fields, [](TapeBuilder&, const BoundedStates&, std::size_t,
                                                          Value value) { return value; }));
  jacobian_ = PatternTapes(
      d_ + columns, 1 + p_,
      sum_over_fields(bound.jacobians, [d = d_](TapeBuilder& builder, const BoundedStates& states,
                                                std::size_t entry, Value value) {
        return builder.binary(Op::multiply, states.slope(entry % d), value);
      }));

  const auto tape_of = [&](std::size_t inputs, std::size_t uniforms, auto&& outputs_of) {
    TapeBuilder builder(inputs + columns, uniforms);
    const BoundedStates states(bounds, builder, inputs_.get(), inputs);
    std::vector<Value> outputs;
    outputs_of(builder, states, outputs);
    return builder.finish(outputs);
  };
  ito_drift_ = tape_of(d_, 0, [&](TapeBuilder& builder, const BoundedStates& states, auto& outputs) {
    for (std::size_t i = 0; i < d_; ++i)
      outputs.push_back(emit(bound.ito_drift[i], states.symbols(), builder));
  });
  diffusion_ = tape_of(d_, 0, [&](TapeBuilder& builder, const BoundedStates& states, auto& outputs) {
    for (std::size_t i = 0; i < d_; ++i)
      for (std::size_t j = 1; j <= p_; ++j)
        outputs.push_back(emit(bound.fields[j][i], states.symbols(), builder));
  });
  euler_step_ = tape_of(d_ + p_, 1, [&](TapeBuilder& builder, const BoundedStates& states, auto& outputs) {
    for (std::size_t i = 0; i < d_; ++i) {
      Value step = builder.binary(Op::multiply, builder.uniform(0),
                                  emit(bound.ito_drift[i], states.symbols(), builder));
      for (std::size_t j = 1; j <= p_; ++j)
        step =
            builder.binary(Op::add, step,
                           builder.binary(Op::multiply, emit(bound.fields[j][i], states.symbols(), builder),
                                          builder.input(d_ + j - 1)));
      outputs.push_back(states.moved_inside(i, builder.binary(Op::add, states.symbols().states[i], step)));
    }
  });
  sensor_ = tape_of(d_, 0, [&](TapeBuilder& builder, const BoundedStates& states, auto& outputs) {
    for (Expression h : bound.sensor) outputs.push_back(emit(h, states.symbols(), builder));
  });
  sensor_derivative_ = tape_of(d_, 0, [&](TapeBuilder& builder, const BoundedStates& states, auto& outputs) {
    for (std::size_t i = 0; i < k_; ++i)
      for (std::size_t r = 1; r <= p_; ++r) {
        if (absorbing_.empty()) {
          outputs.push_back(emit(bound.sensor_derivative[i * p_ + r - 1], states.symbols(), builder));
          continue;
        }
        Value sum = builder.constant(0);
        for (std::size_t l = 0; l < d_; ++l) {
          const Value V = builder.binary(Op::multiply, states.alive(l),
                                         emit(bound.fields[r][l], states.symbols(), builder));
          const Value slope = emit(bound.sensor_gradient[i * d_ + l], states.symbols(), builder);
          sum = builder.binary(Op::add, sum, builder.binary(Op::multiply, V, slope));
        }
        outputs.push_back(sum);
      }
  });

  const bool moved = std::any_of(bounds.begin(), bounds.end(), [](const StateBound& b) {
    return b.bounded() && b.boundary != Boundary::error;
  });
  if (moved) return;
  if (std::optional<AffineFields> affine = text::affine_fields(bound)) flow_.emplace(std::move(*affine));
  affine_sensor_ = text::affine_sensor(bound);
}

// Zero where the component has been absorbed, whatever the tape gave there (1/x at x = 0, say).
void TextFields::freeze(ConstBatchView x, std::size_t rows_per_component, BatchView out) const {
  for (const auto& [i, bound] : absorbing_) {
    const double* const state = x.component(i).data();
    for (std::size_t row = 0; row < rows_per_component; ++row) {
      double* const value = out.component(i * rows_per_component + row).data();
      for (std::size_t n = 0; n < x.nodes(); ++n)
        value[n] = state[n] <= bound.lower || state[n] >= bound.upper ? 0.0 : value[n];
    }
  }
}

void TextFields::direct(ConstBatchView x, std::span<const double> D, BatchView out) const {
  run(direct_.of(D), x, ConstBatchView(), D, out);
  freeze(x, 1, out);
}

void TextFields::jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const {
  run(jacobian_.of(D), x, ConstBatchView(), D, out);
  freeze(x, d_, out);
}

void TextFields::euler_step(ConstBatchView x, double dt, ConstBatchView dB, BatchView out) const {
  run(euler_step_, x, dB, std::span(&dt, 1), out);
  for (const auto& [i, bound] : absorbing_) {
    const double* const state = x.component(i).data();
    double* const value = out.component(i).data();
    for (std::size_t n = 0; n < x.nodes(); ++n)
      value[n] = state[n] <= bound.lower ? bound.lower : state[n] >= bound.upper ? bound.upper : value[n];
  }
}

void TextFields::ito_drift(ConstBatchView x, BatchView out) const {
  run(ito_drift_, x, out);
  freeze(x, 1, out);
}

void TextFields::diffusion(ConstBatchView x, BatchView out) const {
  run(diffusion_, x, out);
  freeze(x, p_, out);
}

void TextFields::sensor(ConstBatchView x, BatchView out) const { run(sensor_, x, out); }

void TextFields::sensor_derivative(ConstBatchView x, BatchView out) const { run(sensor_derivative_, x, out); }

void TextFields::exact_flow(std::span<const double> D, BatchView x) const {
  if (!flow_) return VectorFields::exact_flow(D, x);
  (*flow_)(D, x);
}

}  // namespace wienertree::text
