#include "wienertree/model/recorded_fields.hpp"

#include <algorithm>
#include <cassert>

namespace wienertree {
namespace {

using Value = TapeBuilder::Value;

std::vector<Recorded> states(TapeBuilder& builder, std::size_t d) {
  std::vector<Recorded> x;
  for (std::size_t i = 0; i < d; ++i) x.emplace_back(builder, builder.input(i));
  return x;
}

Tape finish(TapeBuilder& builder, const std::vector<Recorded>& outputs) {
  std::vector<Value> values;
  for (const Recorded& output : outputs) values.push_back(output.on(builder));
  return builder.finish(values);
}

/// out component i = output i of the tape at inputs (x, more).
void run(const Tape& tape, ConstBatchView x, ConstBatchView more, std::span<const double> uniforms,
         BatchView out) {
  assert(x.components() + more.components() == tape.inputs());
  assert(out.components() == tape.outputs() && out.nodes() == x.nodes());
  thread_local std::vector<const double*> inputs;
  thread_local std::vector<double*> outputs;
  inputs.clear();
  outputs.clear();
  for (std::size_t i = 0; i < x.components(); ++i) inputs.push_back(x.component(i).data());
  for (std::size_t i = 0; i < more.components(); ++i) inputs.push_back(more.component(i).data());
  for (std::size_t i = 0; i < out.components(); ++i) outputs.push_back(out.component(i).data());
  tape.evaluate(inputs, uniforms, outputs, x.nodes());
}

bool all_constant(const std::vector<Recorded>& values) {
  return std::all_of(values.begin(), values.end(), [](const Recorded& v) { return v.is_constant(); });
}

}  // namespace

const Tape& RecordedFields::SegmentTapes::of(std::span<const double> D) const {
  assert(D.size() == fields);
  std::size_t set = 0, count = 0, last = 0;
  for (std::size_t k = 0; k < fields; ++k) {
    if (D[k] == 0.0) continue;
    set |= std::size_t{1} << (k % 64);
    ++count;
    last = k;
  }
  if (fields <= 4) return tapes[set];
  return count == 1 ? tapes[last] : tapes[fields];
}

RecordedFields::RecordedFields(std::size_t d, std::size_t p, std::size_t k, const Coefficients& coefficients)
    : d_(d), p_(p), k_(k) {
  direct_ = segment_tapes(coefficients, &RecordedCoefficients::fields);
  jacobian_ = segment_tapes(coefficients, &RecordedCoefficients::jacobians);
  ito_drift_ = tape(coefficients, &RecordedCoefficients::ito_drift);
  sensor_ = tape(coefficients, &RecordedCoefficients::sensor);
  sensor_derivative_ = tape(coefficients, &RecordedCoefficients::sensor_derivative);

  TapeBuilder diffusion(d, 0), euler(d + p, 1);
  std::vector<Recorded> V, next;
  const RecordedCoefficients c = coefficients(states(diffusion, d));
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 1; j <= p; ++j) V.push_back(c.fields[j][i]);
  diffusion_ = finish(diffusion, V);

  const std::vector<Recorded> x = states(euler, d);
  const RecordedCoefficients e = coefficients(x);
  for (std::size_t i = 0; i < d; ++i) {
    Recorded end = x[i] + e.ito_drift[i] * Recorded(euler, euler.uniform(0));
    for (std::size_t j = 1; j <= p; ++j) end += e.fields[j][i] * Recorded(euler, euler.input(d + j - 1));
    next.push_back(end);
  }
  euler_step_ = finish(euler, next);
  find_affine(coefficients);
}

RecordedFields::SegmentTapes RecordedFields::segment_tapes(
    const Coefficients& coefficients, std::vector<std::vector<Recorded>> RecordedCoefficients::*part) const {
  SegmentTapes result;
  result.fields = 1 + p_;
  const auto add = [&](const auto& follows) {
    TapeBuilder builder(d_, 1 + p_);
    const auto terms = coefficients(states(builder, d_)).*part;
    std::vector<Recorded> sums(terms[0].size());
    for (std::size_t k = 0; k <= p_; ++k)
      for (std::size_t i = 0; i < sums.size() && follows(k); ++i)
        sums[i] += terms[k][i] * Recorded(builder, builder.uniform(k));
    result.tapes.push_back(finish(builder, sums));
  };
  if (1 + p_ <= 4) {
    for (std::size_t set = 0; set < std::size_t{1} << (1 + p_); ++set)
      add([set](std::size_t k) { return (set >> k & 1U) != 0; });
    return result;
  }
  for (std::size_t only = 0; only <= p_; ++only) add([only](std::size_t k) { return k == only; });
  add([](std::size_t) { return true; });
  return result;
}

Tape RecordedFields::tape(const Coefficients& coefficients,
                          std::vector<Recorded> RecordedCoefficients::*part) const {
  TapeBuilder builder(d_, 0);
  return finish(builder, coefficients(states(builder, d_)).*part);
}

void RecordedFields::find_affine(const Coefficients& coefficients) {
  TapeBuilder builder(d_, 0);
  const RecordedCoefficients c = coefficients(states(builder, d_));
  Batch origin(d_, 1);
  std::fill_n(origin.view().data(), d_, 0.0);
  const auto derivative = [&](const std::vector<Recorded>& entries, std::size_t rows) {
    Eigen::MatrixXd A(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(d_));
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t l = 0; l < d_; ++l)
        A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(l)) = entries[i * d_ + l].constant();
    return A;
  };
  const auto vector_of = [](const Batch& values) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(values.view().data(),
                                                             static_cast<Eigen::Index>(values.components())));
  };

  std::vector<double> D(1 + p_, 1.0);
  bool affine = !direct_.of(D).jumps() && std::all_of(c.jacobians.begin(), c.jacobians.end(), all_constant);
  AffineFields fields;
  for (std::size_t k = 0; k <= p_ && affine; ++k) {
    Batch b(d_, 1);
    std::fill(D.begin(), D.end(), 0.0);
    D[k] = 1.0;
    direct(origin, D, b);
    fields.linear.push_back(derivative(c.jacobians[k], d_));
    fields.constant.push_back(vector_of(b));
    affine = fields.linear.back().allFinite() && fields.constant.back().allFinite();
  }
  if (affine) flow_.emplace(std::move(fields));

  if (k_ == 0 || sensor_.jumps() || !all_constant(c.sensor_gradient)) return;
  Batch h(k_, 1);
  sensor(origin, h);
  AffineSensor found{derivative(c.sensor_gradient, k_), vector_of(h)};
  if (found.linear.allFinite() && found.constant.allFinite()) affine_sensor_ = std::move(found);
}

void RecordedFields::direct(ConstBatchView x, std::span<const double> D, BatchView out) const {
  run(direct_.of(D), x, {}, D, out);
}

void RecordedFields::jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const {
  run(jacobian_.of(D), x, {}, D, out);
}

void RecordedFields::euler_step(ConstBatchView x, double dt, ConstBatchView dB, BatchView out) const {
  run(euler_step_, x, dB, {&dt, 1}, out);
}

void RecordedFields::ito_drift(ConstBatchView x, BatchView out) const { run(ito_drift_, x, {}, {}, out); }

void RecordedFields::diffusion(ConstBatchView x, BatchView out) const { run(diffusion_, x, {}, {}, out); }

void RecordedFields::sensor(ConstBatchView x, BatchView out) const { run(sensor_, x, {}, {}, out); }

void RecordedFields::sensor_derivative(ConstBatchView x, BatchView out) const {
  run(sensor_derivative_, x, {}, {}, out);
}

void RecordedFields::exact_flow(std::span<const double> D, BatchView x) const {
  if (!flow_) return VectorFields::exact_flow(D, x);
  (*flow_)(D, x);
}

}  // namespace wienertree
