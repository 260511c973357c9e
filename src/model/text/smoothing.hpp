#pragma once
/// Kinks of expressions, smoothed so that averages over a smooth law hardly change.
///
/// max(u, 0) convolved with the kernel of order 2r made of the Gaussian density phi (Wand, Schucany 1990,
/// "Gaussian-based kernels", Canad. J. Statist. 18, 197-204),
///
///     K_h(x) = (1/h) sum_{j<r} (-1)^j / (2^j j!) phi^{(2j)}(x/h),    Fourier transform at k:
///              exp(-y) sum_{j<r} y^j / j!,  y = (h k)^2 / 2,  which is 1 - y^r/r! + ..,
///
/// is in closed form
///
///     f_h(u) = h ( z Phi(z) + phi(z) P(z) ),   z = u/h,   P = 1 + sum_{0<j<r} (-1)^j / (2^j j!) He_{2j-2}.
///
/// If u has a density p with 2r - 2 derivatives, E f_h(u) - E max(u, 0) = O(h^{2r} |p^{(2r-2)}|): for a
/// Gaussian u of standard deviation 1, r = 6 and h = 0.4 it is 7e-8. f_h itself is analytic. Smoothing the
/// data so restores the order of methods for smooth ones (Kreiss, Thomee, Widlund 1970, "Smoothing of initial
/// data and rates of convergence for parabolic difference equations", Comm. Pure Appl. Math. 23, 241-259).
/// The same for max(a, b) = b + max(a - b, 0), min(a, b) = a - max(a - b, 0), |a| = 2 max(a, 0) - a.
#include <vector>

#include "wienertree/model/text/expression.hpp"

namespace wienertree::text {

inline constexpr int smoothing_terms = 6;  ///< r

/// `value` has 1/h of kink k as the symbol of observation k.
struct SmoothedKinks {
  Expression value;
  std::vector<Expression> arguments;  ///< u of every kink, without smoothing; equal ones once
};

/// A jump step(u), which is 1 for u > 0, becomes f_h'(u) = Phi(z) + phi(z) (z (1 - P(z)) + P'(z)), and
/// sign(u) = 2 step(u) - 1. @pre no parameter or observation occurs in `e`
SmoothedKinks smooth_kinks(Expression e, Arena& arena);

}  // namespace wienertree::text
