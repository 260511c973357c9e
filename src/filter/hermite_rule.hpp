#pragma once
/// Gauss-Hermite quadrature on the line with the projections that tell whether it suffices.
#include <vector>

namespace wienertree {

/// sum_j weight_j f(z_j) = E f(Z), Z standard normal, for polynomials of degree 2n - 1. With the orthonormal
/// Hermite polynomials h_k = He_k / sqrt(k!), the rows first, second, before_last and last hold weight_j
/// h_k(z_j) for k = 1, 2, n - 2, n - 1.
struct HermiteRule {
  std::vector<double> z, weight, log_weight, first, second, before_last, last;
  std::size_t size() const { return z.size(); }
};

/// @param n >= 3
HermiteRule hermite_rule(std::size_t n);

}  // namespace wienertree
