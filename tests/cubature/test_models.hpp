#pragma once
/// Models written by hand for the tests of the flow: equations as templates over the number type, so that the
/// reference solution can be computed in extended precision.
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "wienertree/model/model.hpp"
#include "wienertree/model/vector_fields.hpp"

namespace wienertree::test {

/// `Equations` has d, p, `template <class T> void field(const T* x, const double* D, T* out)` with
/// out_i = sum_k V_k^i(x) D_k, and `void jacobian(const double* x, const double* D, double* out)`.
template <class Equations>
class EquationFields : public VectorFields {
 public:
  explicit EquationFields(Equations equations = {}) : equations_(equations) {}
  const Equations& equations() const { return equations_; }

  std::size_t state_dimension() const override { return Equations::d; }
  std::size_t noise_dimension() const override { return Equations::p; }
  std::size_t sensor_dimension() const override { return 0; }
  void direct(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    each<Equations::d>(x, out,
                       [&](const double* state, double* value) { equations_.field(state, D.data(), value); });
  }
  void jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const override {
    each<Equations::d * Equations::d>(
        x, out, [&](const double* state, double* value) { equations_.jacobian(state, D.data(), value); });
  }
  void euler_step(ConstBatchView, double, ConstBatchView, BatchView) const override {}
  void ito_drift(ConstBatchView, BatchView) const override {}
  void diffusion(ConstBatchView, BatchView) const override {}
  void sensor(ConstBatchView, BatchView) const override {}
  void sensor_derivative(ConstBatchView, BatchView) const override {}

 private:
  template <std::size_t size, class F>
  static void each(ConstBatchView x, BatchView out, F f) {
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      std::array<double, Equations::d> state;
      std::array<double, size> value;
      for (std::size_t i = 0; i < state.size(); ++i) state[i] = x(i, n);
      f(state.data(), value.data());
      for (std::size_t i = 0; i < value.size(); ++i) out(i, n) = value[i];
    }
  }
  Equations equations_;
};

inline Model model_with(std::string name, std::shared_ptr<const VectorFields> fields,
                        std::vector<double> initial) {
  Model model;
  model.name = std::move(name);
  model.initial = std::move(initial);
  for (std::size_t i = 0; i < model.initial.size(); ++i)
    model.state_names.push_back(std::string("x").append(std::to_string(i)));
  model.bounds.resize(model.initial.size());
  model.fields = std::move(fields);
  return model;
}

template <class Equations>
Model model_of(std::string name, Equations equations, std::vector<double> initial) {
  return model_with(std::move(name), std::make_shared<EquationFields<Equations>>(equations),
                    std::move(initial));
}

/// Benes: dX = mu sigma tanh(mu X / sigma) dt + sigma o dB.
struct Tanh {
  static constexpr std::size_t d = 1, p = 1;
  double mu = 0.5, sigma = 0.8;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0] * mu * sigma) * std::tanh(T(mu / sigma) * x[0]) + T(sigma * D[1]);
  }
  void jacobian(const double* x, const double* D, double* out) const {
    const double y = std::tanh(mu / sigma * x[0]);
    out[0] = D[0] * mu * mu * (1 - y * y);
  }
};

/// Ornstein-Uhlenbeck: dX = rate (mean - X) dt + sigma dB, with its closed form.
struct OrnsteinUhlenbeck {
  static constexpr std::size_t d = 1, p = 1;
  double rate = 1.3, mean = 0.4, sigma = 0.7;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0] * rate) * (T(mean) - x[0]) + T(sigma * D[1]);
  }
  void jacobian(const double*, const double* D, double* out) const { out[0] = -D[0] * rate; }
};

class OrnsteinUhlenbeckFields final : public EquationFields<OrnsteinUhlenbeck> {
 public:
  bool has_exact_flow() const override { return true; }
  /// x e^-a + (mean a + sigma D_1) (1 - e^-a) / a, a = rate D_0.
  void exact_flow(std::span<const double> D, BatchView x) const override {
    const auto& [rate, mean, sigma] = equations();
    const double a = rate * D[0], push = mean * a + sigma * D[1];
    const double weight = a == 0 ? 1.0 : -std::expm1(-a) / a;
    for (double& value : x.component(0)) value = value * std::exp(-a) + push * weight;
  }
};

/// Three coupled linear equations, p = 2, with non-commuting matrices.
struct Linear3 {
  static constexpr std::size_t d = 3, p = 2;
  static constexpr double A[3][3][3] = {{{-0.5, 0.3, 0.0}, {0.2, -1.0, 0.4}, {0.0, 0.5, -0.7}},
                                        {{0.3, 0.1, -0.2}, {0.0, 0.2, 0.4}, {-0.3, 0.1, 0.1}},
                                        {{0.0, -0.4, 0.1}, {0.4, 0.0, 0.0}, {0.2, 0.1, -0.1}}};
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    for (std::size_t i = 0; i < 3; ++i) {
      out[i] = 0;
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l) out[i] += T(A[k][i][l] * D[k]) * x[l];
    }
  }
  void jacobian(const double*, const double* D, double* out) const {
    for (std::size_t i = 0; i < 9; ++i) out[i] = 0;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 9; ++i) out[i] += A[k][i / 3][i % 3] * D[k];
  }
};

/// Heston in Stratonovich form: price and variance.
struct Heston {
  static constexpr std::size_t d = 2, p = 2;
  double r = 0.05, kappa = 2, theta = 0.09, xi = 0.1, rho = -0.3;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    const T s = x[0], v = x[1], root = std::sqrt(v);
    out[0] = T(D[0]) * s * (T(r) - v / T(2) - T(rho * xi / 4)) + T(D[1]) * root * s;
    out[1] = T(D[0]) * (T(kappa) * (T(theta) - v) - T(xi * xi / 4)) +
             T(xi * (rho * D[1] + std::sqrt(1 - rho * rho) * D[2])) * root;
  }
  void jacobian(const double* x, const double* D, double* out) const {
    const double s = x[0], v = x[1], root = std::sqrt(v);
    out[0] = D[0] * (r - v / 2 - rho * xi / 4) + D[1] * root;
    out[1] = -D[0] * s / 2 + D[1] * s / (2 * root);
    out[2] = 0;
    out[3] = -D[0] * kappa + xi * (rho * D[1] + std::sqrt(1 - rho * rho) * D[2]) / (2 * root);
  }
};

/// Lorenz (1963) with additive noise in each component.
struct Lorenz {
  static constexpr std::size_t d = 3, p = 1;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0]) * T(10) * (x[1] - x[0]) + T(D[1]);
    out[1] = T(D[0]) * (x[0] * (T(28) - x[2]) - x[1]) + T(D[1]);
    out[2] = T(D[0]) * (x[0] * x[1] - T(8) / T(3) * x[2]) + T(D[1]);
  }
  void jacobian(const double* x, const double* D, double* out) const {
    const double J[9] = {-10, 10, 0, 28 - x[2], -1, -x[0], x[1], x[0], -8.0 / 3};
    for (std::size_t i = 0; i < 9; ++i) out[i] = D[0] * J[i];
  }
};

/// A fast relaxation towards a slow curve: dX = -rate (X - cos Y) dt, dY = dt + 0.2 dB.
struct Stiff {
  static constexpr std::size_t d = 2, p = 1;
  double rate = 1e4;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(-rate * D[0]) * (x[0] - std::cos(x[1]));
    out[1] = T(D[0] + 0.2 * D[1]);
  }
  void jacobian(const double* x, const double* D, double* out) const {
    out[0] = -rate * D[0];
    out[1] = -rate * D[0] * std::sin(x[1]);
    out[2] = out[3] = 0;
  }
};

/// Van der Pol's oscillator, dX = Y dt, dY = (mu (1 - X^2) Y - X) dt + 0.1 dB.
struct VanDerPol {
  static constexpr std::size_t d = 2, p = 1;
  double mu = 1e3;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0]) * x[1];
    out[1] = T(D[0]) * (T(mu) * (T(1) - x[0] * x[0]) * x[1] - x[0]) + T(0.1 * D[1]);
  }
  void jacobian(const double* x, const double* D, double* out) const {
    out[0] = 0;
    out[1] = D[0];
    out[2] = D[0] * (-2 * mu * x[0] * x[1] - 1);
    out[3] = D[0] * mu * (1 - x[0] * x[0]);
  }
};

/// Rotation of (x, y) at the speed w that each node carries as its third component: exact, and as hard as w.
struct Rotation {
  static constexpr std::size_t d = 3, p = 1;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(-D[0]) * x[2] * x[1];
    out[1] = T(D[0]) * x[2] * x[0];
    out[2] = 0;
  }
  void jacobian(const double* x, const double* D, double* out) const {
    const double J[9] = {0, -x[2], -x[1], x[2], 0, x[0], 0, 0, 0};
    for (std::size_t i = 0; i < 9; ++i) out[i] = D[0] * J[i];
  }
};

/// dX = X^2 dt + sigma dB: x / (1 - x D_0) leaves every bound at D_0 = 1/x.
struct BlowUp {
  static constexpr std::size_t d = 1, p = 1;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0]) * x[0] * x[0] + T(D[1]);
  }
  void jacobian(const double* x, const double* D, double* out) const { out[0] = 2 * D[0] * x[0]; }
};

/// Feller's square root: dX = kappa (theta - X) dt - xi^2/4 dt + xi sqrt(X) o dB; NaN below 0.
struct SquareRoot {
  static constexpr std::size_t d = 1, p = 1;
  double kappa = 1, theta = 0.2, xi = 1;
  template <class T>
  void field(const T* x, const double* D, T* out) const {
    out[0] = T(D[0]) * (T(kappa) * (T(theta) - x[0]) - T(xi * xi / 4)) + T(xi * D[1]) * std::sqrt(x[0]);
  }
  void jacobian(const double* x, const double* D, double* out) const {
    out[0] = -D[0] * kappa + xi * D[1] / (2 * std::sqrt(x[0]));
  }
};

}  // namespace wienertree::test
