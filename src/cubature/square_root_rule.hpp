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
/// The integral I of v over the step given both ends is
///
///     I = mu(v_s) +- r,     mu = E I + b_1 e_1(v_s) + b_2 e_2(v_s),
///
/// e_1, e_2 orthonormal polynomials of degrees 1 and 2 and both signs equally likely, where b_1, b_2 and r make
/// E[I v_s], E[I v_s^2] and E I^2 exact (these are polynomials of x: the generator maps polynomials of (v, I) to such
/// of the same degree). Weak order q - 1. Near 0 that may be negative, which a variance must not be. Where it is to
/// be kept from that, mu is moved towards the trapezoid between both ends, scaled to the exact E I, as far as it
/// takes; and I = mu F with an independent factor F >= 0 of two values and mean 1, such that E I^2 is exact.
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
    std::array<double, 2> share;                             ///< their probabilities
  };
  /// @pre x >= 0
  Children children(double x) const;

  /// E v_s and its standard deviation.
  double mean(double x) const { return growth_ * x + mean_of_zero_; }
  double deviation(double x) const;

 private:
  void add_integral(double x, Children& children) const;
  void keep_nonnegative(double I, double II, double sum, std::array<double, most_nodes> mu,
                        std::array<double, most_nodes> trapezoid, Children& children) const;

  std::size_t q_;
  bool nonnegative_;
  double growth_, mean_of_zero_;
  double g_, delta_;
  /// Coefficients of 1, x, x^2, x^3 in E I, E[I v_s], E[I v_s^2], E I^2.
  std::array<std::array<double, 4>, 4> moments_{};
};

}  // namespace wienertree
