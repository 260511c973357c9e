#pragma once
/// The two ways to evaluate a model written in C++: node by node, or recorded as tapes.
#include <algorithm>
#include <array>
#include <vector>

#include "wienertree/model/differentiation.hpp"
#include "wienertree/model/recorded_fields.hpp"

namespace wienertree {

/// Calls the model for each node with numbers that know their derivatives, so that it may branch.
template <CppModelType M>
class NodeFields : public VectorFields {
 public:
  explicit NodeFields(M model) : model_(std::move(model)) {}

  std::size_t state_dimension() const override { return d; }
  std::size_t noise_dimension() const override { return p; }
  std::size_t sensor_dimension() const override { return k; }

  void direct(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const auto V = At<M, Number>{model_, state}.fields();
      for (std::size_t i = 0; i < d; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j <= p; ++j)
          if (D[j] != 0.0) sum += V[j][i].value * D[j];
        out(i, n) = sum;
      }
    });
  }
  void jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const auto y = At<M, Number>{model_, state}.differentiated();
      const auto V = At<M, Dual<Number, d>>{model_, y}.fields();
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t l = 0; l < d; ++l) {
          double sum = 0.0;
          for (std::size_t j = 0; j <= p; ++j)
            if (D[j] != 0.0) sum += V[j][i].slopes[l].value * D[j];
          out(i * d + l, n) = sum;
        }
    });
  }
  void euler_step(ConstBatchView x, double dt, ConstBatchView dB, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const State drift = At<M, Number>{model_, state}.ito_drift();
      const std::array<std::array<Number, p>, d> V = model_.diffusion(state);
      for (std::size_t i = 0; i < d; ++i) {
        double end = state[i].value + drift[i].value * dt;
        for (std::size_t j = 0; j < p; ++j) end += V[i][j].value * dB(j, n);
        out(i, n) = end;
      }
    });
  }
  void ito_drift(ConstBatchView x, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const State drift = At<M, Number>{model_, state}.ito_drift();
      for (std::size_t i = 0; i < d; ++i) out(i, n) = drift[i].value;
    });
  }
  void diffusion(ConstBatchView x, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const std::array<std::array<Number, p>, d> V = model_.diffusion(state);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < p; ++j) out(i * p + j, n) = V[i][j].value;
    });
  }
  void sensor(ConstBatchView x, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const auto h = At<M, Number>{model_, state}.sensor();
      for (std::size_t i = 0; i < k; ++i) out(i, n) = h[i].value;
    });
  }
  void sensor_derivative(ConstBatchView x, BatchView out) const override {
    for_each(x, [&](std::size_t n, const State& state) {
      const auto slopes = At<M, Number>{model_, state}.sensor_derivative();
      for (std::size_t i = 0; i < k; ++i)
        for (std::size_t r = 0; r < p; ++r) out(i * p + r, n) = slopes[i][r].value;
    });
  }

 private:
  static constexpr std::size_t d = M::state_dimension, p = M::noise_dimension, k = M::sensor_dimension;
  using State = std::array<Number, d>;

  template <class F>
  static void for_each(ConstBatchView x, F&& f) {
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      State state;
      for (std::size_t i = 0; i < d; ++i) state[i] = Number(x(i, n));
      f(n, state);
    }
  }
  M model_;
};

/// The tapes of a model that does not branch on its state.
template <CppModelType M>
RecordedFields record(const M& model) {
  constexpr std::size_t d = M::state_dimension, p = M::noise_dimension, k = M::sensor_dimension;
  return RecordedFields(d, p, k, [&model](std::span<const Recorded> states) {
    std::array<Recorded, d> x;
    std::copy(states.begin(), states.end(), x.begin());
    const At<M, Recorded> here{model, x};
    const auto y = here.differentiated();
    const At<M, Dual<Recorded, d>> nearby{model, y};
    RecordedCoefficients c;
    for (const auto& V : here.fields()) c.fields.emplace_back(V.begin(), V.end());
    for (const auto& V : nearby.fields()) {
      auto& entries = c.jacobians.emplace_back();
      for (const auto& component : V)
        entries.insert(entries.end(), component.slopes.begin(), component.slopes.end());
    }
    const auto drift = here.ito_drift();
    const auto h = here.sensor();
    c.ito_drift.assign(drift.begin(), drift.end());
    c.sensor.assign(h.begin(), h.end());
    for (const auto& component : nearby.sensor())
      c.sensor_gradient.insert(c.sensor_gradient.end(), component.slopes.begin(), component.slopes.end());
    for (const auto& row : here.sensor_derivative())
      c.sensor_derivative.insert(c.sensor_derivative.end(), row.begin(), row.end());
    return c;
  });
}

template <class M>
concept HasExactFlow = requires(const M& m, const std::array<double, 1 + M::noise_dimension>& D,
                                const std::array<double, M::state_dimension>& x) {
  { m.exact_flow(D, x) } -> std::convertible_to<std::array<double, M::state_dimension>>;
};

/// Fields with the model's own closed form of the flow, where it has one.
template <class Fields, class M>
class WithExactFlow final : public Fields {
 public:
  WithExactFlow(M model, Fields fields) : Fields(std::move(fields)), model_(std::move(model)) {}
  bool has_exact_flow() const override { return HasExactFlow<M> || Fields::has_exact_flow(); }
  void exact_flow(std::span<const double> D, BatchView x) const override {
    if constexpr (HasExactFlow<M>) {
      std::array<double, 1 + M::noise_dimension> increments;
      std::copy(D.begin(), D.end(), increments.begin());
      std::array<double, M::state_dimension> state;
      for (std::size_t n = 0; n < x.nodes(); ++n) {
        for (std::size_t i = 0; i < state.size(); ++i) state[i] = x(i, n);
        state = model_.exact_flow(increments, state);
        for (std::size_t i = 0; i < state.size(); ++i) x(i, n) = state[i];
      }
    } else {
      Fields::exact_flow(D, x);
    }
  }

 private:
  M model_;
};

}  // namespace wienertree
