#pragma once
/// Square-root processes by the exact moments of their transition.
///
///     dv = (a + b v) dt + sqrt(c v) dB,   v_0 = x >= 0,   a >= 0      (Cox, Ingersoll, Ross 1985, Econometrica 53)
///
/// v_s = g Z, where Z is noncentral chi-square with delta = 4 a/c degrees of freedom and noncentrality
/// l = x e^{b s}/g, and g = c (e^{b s} - 1)/(4 b). Its cumulants are 2^{j-1} (j-1)! (delta + j l) g^j. From 2q
/// of them comes the Gauss rule of q nodes, exact for polynomials of degree 2q - 1 (Chebyshev's algorithm:
/// Gautschi 2004, Orthogonal Polynomials, section 2.1.7), for every x >= 0 and every delta: nodes in [0, inf),
/// positive weights, no threshold, no bound to clamp at, whether or not 2a >= c (Feller's condition).
///
/// The integral I of v over the step is drawn along with v_s = v. Its first two moments given v are projected on
/// the orthonormal polynomials e_0 .. e_{q-1} of the law of v_s,
///
///     mu(v) = sum_i E[I e_i] e_i(v),   S(v) = sum_i E[I^2 e_i] e_i(v),
///
/// so that all E[I v^i] and E[I^2 v^i], i < q, are exact (these are polynomials of x: the generator maps
/// polynomials of (v, I) to such of the same degree). At each node I takes two values of mean mu, variance
/// r^2 = S - mu^2 and the skewness 2 rho, rho = r/mu, of a gamma law, which are positive:
///
///     I = mu (1 - rho t) or mu (1 + rho/t)  with probabilities  1/(1 + t^2), t^2/(1 + t^2),   t = sqrt(1 + rho^2) - rho.
///
/// Where a projection is negative it is set to 0, and the others are scaled so that E I and E I^2 stay exact.
/// Weak order q - 1.
#include <array>
#include <cstddef>

#include "wienertree/model/square_root.hpp"

namespace wienertree {

/// The rule for one length of step.
class SquareRootRule {
 public:
  static constexpr std::size_t most_nodes = 4;
  /// @param q 2 to 4   @param nonnegative whether the integral must not be negative
  /// @throws InputError unless the process and s are as above
  SquareRootRule(const SquareRootProcess& process, double s, std::size_t q, bool nonnegative = true);

  std::size_t nodes() const { return q_; }
  struct Children {
    std::array<double, most_nodes> v, weight;                ///< q each, v ascending; weights sum to 1
    std::array<std::array<double, 2>, most_nodes> integral;  ///< the two values of I at each node
    std::array<std::array<double, 2>, most_nodes> share;     ///< their probabilities
  };
  /// @pre x >= 0
  Children children(double x) const;

  /// E v_s and its standard deviation.
  double mean(double x) const { return growth_ * x + mean_of_zero_; }
  double deviation(double x) const;

 private:
  /// sd/mean of v_s below which the variance of I is taken to be the same at all nodes.
  static constexpr double narrow_law = 0.02;
  /// @param given E[I | v], E[I^2 | v] at the nodes
  void add_integral(double I, double II, bool narrow,
                    const std::array<std::array<double, most_nodes>, 2>& given, Children& children) const;

  std::size_t q_;
  bool nonnegative_;
  double growth_, mean_of_zero_;
  double g_, delta_;
  /// [j-1][i][k]: the coefficient of x^k in E[I^j v_s^i].
  std::array<std::array<std::array<double, most_nodes + 2>, most_nodes>, 2> moments_{};
};

}  // namespace wienertree
