#pragma once
/// What a model written in C++ looks like, and its fields and derivatives for any scalar.
#include <array>
#include <concepts>
#include <cstddef>

#include "wienertree/model/dual.hpp"

namespace wienertree {

/// How `drift` is to be read: as V~_0 or as V_0 = V~_0 - 1/2 sum_j (DV_j) V_j.
enum class Convention { ito, stratonovich };

/// Base of a model in d states, p Brownian motions and k observed components: names for its arrays.
template <std::size_t d, std::size_t p, std::size_t k = 0>
struct CppModel {
  static constexpr std::size_t state_dimension = d, noise_dimension = p, sensor_dimension = k;
  template <class T>
  using State = std::array<T, d>;
  template <class T>
  using Diffusion = std::array<std::array<T, p>, d>;  ///< entry [i][j-1] is V_j^i
  template <class T>
  using Sensor = std::array<T, k>;
};

template <class M>
inline constexpr bool branches = false;
template <class M>
requires requires {
  { M::branches } -> std::convertible_to<bool>;
}
inline constexpr bool branches<M> = M::branches;

/// A number that is not differentiated: a class, so that tanh(x) is found without `std::`.
using Number = Dual<double, 0>;

template <class M, class T>
concept HasCoefficientsIn = requires(const M& m, const std::array<T, M::state_dimension>& x) {
  { m.drift(x) } -> std::convertible_to<std::array<T, M::state_dimension>>;
  {
    m.diffusion(x)
    } -> std::convertible_to<std::array<std::array<T, M::noise_dimension>, M::state_dimension>>;
};
template <class M, class T>
concept HasSensorIn = M::sensor_dimension == 0 ||
                      requires(const M& m, const std::array<T, M::state_dimension>& x) {
  { m.sensor(x) } -> std::convertible_to<std::array<T, M::sensor_dimension>>;
};

/// A model for which derivatives are found: see cpp_model.hpp for an example.
template <class M>
concept CppModelType = requires {
  { M::state_dimension } -> std::convertible_to<std::size_t>;
  { M::noise_dimension } -> std::convertible_to<std::size_t>;
  { M::sensor_dimension } -> std::convertible_to<std::size_t>;
  { M::convention } -> std::convertible_to<Convention>;
}
&&(M::state_dimension > 0) && HasCoefficientsIn<M, Number>&& HasSensorIn<M, Number>;

/// The model's functions and their derivatives at x for the scalar S, itself perhaps a Dual.
template <class M, class S>
struct At {
  static constexpr std::size_t d = M::state_dimension, p = M::noise_dimension, k = M::sensor_dimension;
  using State = std::array<S, d>;
  const M& model;
  const State& x;

  /// V~_0
  State ito_drift() const {
    State V = model.drift(x);
    if constexpr (M::convention == Convention::stratonovich) add_half_correction(V, 0.5);
    return V;
  }
  /// V_0 .. V_p
  std::array<State, 1 + p> fields() const {
    std::array<State, 1 + p> V;
    V[0] = model.drift(x);
    if constexpr (M::convention == Convention::ito) add_half_correction(V[0], -0.5);
    const std::array<std::array<S, p>, d> rows = model.diffusion(x);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 1; j <= p; ++j) V[j][i] = rows[i][j - 1];
    return V;
  }
  /// h
  std::array<S, k> sensor() const {
    if constexpr (k == 0)
      return {};
    else
      return model.sensor(x);
  }
  /// Entry [i][r-1] is V_r h_i, the derivative of h_i along V_r.
  std::array<std::array<S, p>, k> sensor_derivative() const {
    std::array<std::array<S, p>, k> result;
    const auto h = At<M, Dual<S, p>>{model, along_noise()}.sensor();
    for (std::size_t i = 0; i < k; ++i) result[i] = h[i].slopes;
    return result;
  }
  /// x with its derivatives with respect to x_1 .. x_d.
  std::array<Dual<S, d>, d> differentiated() const {
    std::array<Dual<S, d>, d> y;
    for (std::size_t i = 0; i < d; ++i) {
      y[i].value = x[i];
      y[i].slopes[i] = S(1.0);
    }
    return y;
  }

 private:
  /// x moving along V_1 .. V_p: slope j-1 of component i is V_j^i.
  std::array<Dual<S, p>, d> along_noise() const {
    const std::array<std::array<S, p>, d> rows = model.diffusion(x);
    std::array<Dual<S, p>, d> y;
    for (std::size_t i = 0; i < d; ++i) y[i] = {x[i], rows[i]};
    return y;
  }
  /// V += factor sum_j (DV_j) V_j: (DV_j) V_j is the slope of V_j along itself.
  void add_half_correction(State& V, double factor) const {
    if constexpr (p > 0) {
      const std::array<Dual<S, p>, d> y = along_noise();
      const std::array<std::array<Dual<S, p>, p>, d> rows = model.diffusion(y);
      for (std::size_t i = 0; i < d; ++i) {
        S sum(0.0);
        for (std::size_t j = 0; j < p; ++j) sum += rows[i][j].slopes[j];
        V[i] += factor * sum;
      }
    }
  }
};

}  // namespace wienertree
