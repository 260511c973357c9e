#pragma once
/// Gauss's rule of a law by its moments.
#include <array>
#include <cstddef>

namespace wienertree {

/// q <= 4 nodes, ascending, of a law of mean 0 and variance 1.
struct GaussRule {
  static constexpr std::size_t most_nodes = 4;
  using Values = std::array<double, most_nodes>;
  std::size_t size = 0;  ///< less than was asked for where the law has no more points, to rounding
  Values node{}, weight{};
  /// e_i(z_m) at [i][m], and the coefficient of z^r in e_i at [i][r]: e_0 .. e_{q-1} are orthonormal under the law.
  std::array<Values, most_nodes> value{}, coefficient{};
};

/// Chebyshev's algorithm (Gautschi 2004, Orthogonal Polynomials, section 2.1.7), then the eigenvalues of the
/// tridiagonal matrix (Golub, Welsch 1969). Weights are 1/sum_i e_i^2, which keeps the relative accuracy of small ones.
/// @param moment E z^k, k < 2q; moment[0] = 1, moment[1] = 0, moment[2] = 1
/// @pre 2 <= q <= 4
GaussRule gauss_rule(const std::array<long double, 9>& moment, std::size_t q);

}  // namespace wienertree
