#pragma once
/// Models written in C++, which the tests of derivatives, of both ways of evaluation and of make_model run
/// on.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "model/derivatives.hpp"
#include "wienertree/model/cpp_model.hpp"

namespace wienertree::test {

using Faults = std::vector<std::string>;

/// dX = mu sigma tanh(mu X/sigma) dt + sigma dB,  h = h1 x + h2
struct Benes : CppModel<1, 1, 1> {
  static constexpr auto convention = Convention::ito;
  double mu = 0.6, sigma = 1.2, h1 = 0.8, h2 = 0.1;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {mu * sigma * tanh(mu / sigma * x[0])};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>&) const {
    return {{{sigma}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {h1 * x[0] + h2};
  }
};

template <Convention given>
struct Heston : CppModel<2, 2, 2> {
  static constexpr auto convention = given;
  double r = 0.05, kappa = 2, theta = 0.09, xi = 0.4, rho = -0.3;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {r * x[0], kappa * (theta - x[1])};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    const T v = sqrt(x[1]);
    return {{{v * x[0], 0.0}, {rho * xi * v, std::sqrt(1 - rho * rho) * xi * v}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {log(x[0]), x[1] * x[0]};
  }
};

/// dX = (A X + a) dt + (B X + b) o dB, h = H X + c; d = 2, p = 1, k = 1
struct Linear : CppModel<2, 1, 1> {
  static constexpr auto convention = Convention::stratonovich;
  double noise_slope = 0.5;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {-x[0] + 0.5 * x[1] + 1, 0.25 * x[0] - 2 * x[1]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{1 + noise_slope * x[1]}, {-0.7}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {2 * x[0] - x[1] + 3};
  }
};

/// Every function that a model may call, d = 3, p = 2.
template <Convention given>
struct Everything : CppModel<3, 2, 2> {
  static constexpr auto convention = given;
  template <class T>
  State<T> drift(const State<T>& x) const {
    T sum = 0;
    for (const T& component : x) sum += component;
    sum /= 3;
    return {exp(-sum * sum) + atan(x[1]) - pow(x[0], 3), erf(x[0]) * cosh(x[1] / 4) - erfc(x[2]),
            pow(2 + sin(x[0]), x[1]) / (1 + x[2] * x[2])};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{cos(x[0] * x[1]), 0.5},
             {tan(x[1] / 4), sinh(x[2] / 3)},
             {max(x[0], -x[0]), abs(x[2]) * tanh(x[0])}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {log(2 + sin(x[0])) + sign(x[1]), min(x[1], 3.0) * sqrt(1.5 + cos(x[2])) + step(x[0])};
  }
};

/// A drift given in pieces, in two ways.
struct Branching : CppModel<1, 1, 1> {
  static constexpr auto convention = Convention::ito;
  static constexpr bool branches = true;
  template <class T>
  State<T> drift(const State<T>& x) const {
    if (x[0] > 0) return {1 - x[0]};
    return {1 + x[0] * x[0] / 2};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    T amplitude = 1;
    for (int i = 0; i < 3 && amplitude < 1 + x[0] * x[0]; ++i) amplitude *= 1 + x[0] * x[0] / 4;
    return {{{amplitude}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {x[0] < 1 ? x[0] * x[0] : 2 * x[0] - 1};
  }
};

template <class M>
struct NodeByNode : M {
  using M::M;
  static constexpr bool branches = true;
};

/// dX = mu X dt + sigma X o dB, whose flow is x exp(mu D_0 + sigma D_1); no sensor.
struct Geometric : CppModel<1, 1> {
  static constexpr auto convention = Convention::stratonovich;
  double mu = 0.1, sigma = 0.3;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {mu * x[0]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{sigma * x[0]}}};
  }
  State<double> exact_flow(const std::array<double, 2>& D, const State<double>& x) const {
    return {x[0] * std::exp(mu * D[0] + sigma * D[1])};
  }
};

/// sign and step have derivative 0 and are not affine.
struct Jump : Linear {
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {step(x[0]), x[1]};
  }
};

/// Without its own flow.
struct PlainGeometric : Geometric {
  void exact_flow() const = delete;
};

struct Wrong : CppModel<1, 1, 1> {  // takes the derivative of sin to be cos/1.00001
  static constexpr auto convention = Convention::ito;
  static constexpr bool branches = true;
  template <class T>
  static T bent(const T& x) {
    T y = sin(x);
    for (auto& slope : y.slopes) slope = slope / 1.00001;
    return y;
  }
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {bent(x[0])};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{2 + bent(x[0])}}};
  }
  template <class T>
  Sensor<T> sensor(const State<T>& x) const {
    return {bent(x[0])};
  }
};

inline Batch states(std::size_t d, std::size_t N, double lower, double upper) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(lower, upper);
  Batch x(d, N);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t n = 0; n < N; ++n) x(i, n) = uniform(generator);
  return x;
}

template <class M>
void check_both_ways(const M& model, const Batch& x) {
  CHECK(derivative_faults(*make_vector_fields(model), x) == Faults{});
  CHECK(position_faults(*make_vector_fields(model), x) == Faults{});
  NodeByNode<M> slow;
  static_cast<M&>(slow) = model;
  CHECK(derivative_faults(*make_vector_fields(slow), x) == Faults{});
  CHECK(position_faults(*make_vector_fields(slow), x) == Faults{});
}

}  // namespace wienertree::test
