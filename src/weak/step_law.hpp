#pragma once
/// The law of a payoff's argument over the last step, from the moments that a cubature formula keeps.
///
///     u = m + a (b z + c (z^2 - 1) + d (z^3 - 3 z)),   z standard normal,   a^2 the variance,
///
/// has the mean m and, for the coefficients below, the further cumulants that are wanted.
///
/// Three moments (d = 0):  6 c - 4 c^3 = gamma,  b = sqrt(1 - 2 c^2),  gamma = k3 / k2^{3/2}, for |gamma| up
/// to 2.6, the root |c| < 1/sqrt 2. Four (Fleishman 1978, "A method for simulating non-normal distributions",
/// Psychometrika 43, 521-532), with B = b - 3 d:
///
///     B^2 + 6 B d + 2 c^2 + 15 d^2 = 1,     2 c (B^2 + 24 B d + 105 d^2 + 2) = gamma,
///     24 (B d + c^2 (1 + B^2 + 28 B d) + d^2 (12 + 48 B d + 141 c^2 + 225 d^2)) = k4 / k2^2.
///
/// Where b < 0.3, |c| > 0.35 or |d| > 0.2 the law with four moments bends back too early, and three are kept.
#include <array>
#include <cstddef>
#include <span>

namespace wienertree {

struct StepLaw {
  double mean = 0, deviation = 0;  ///< m, a
  double b = 1, c = 0, d = 0;

  double operator()(double z) const { return mean + deviation * standard(z); }
  /// (u - m) / a
  double standard(double z) const { return b * z + c * (z * z - 1) + d * z * (z * z - 3); }
};

/// Of values u_j with weights w_j > 0, not normalised. Equal values: deviation = 0.
/// @param four whether the fourth moment is kept as well
StepLaw step_law(std::span<const double> u, std::span<const double> w, bool four);

/// All z, ascending, where the law equals `value`, of |z| < reach. At most 3.
struct Crossings {
  std::array<double, 3> z{};
  std::size_t count = 0;
};
Crossings crossings(const StepLaw& law, double value, double reach);

}  // namespace wienertree
