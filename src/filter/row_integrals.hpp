#pragma once
/// Integrals over a window of rows (t_r, Y_r), r = 0..gaps, against U_u = Y_end - Y_u with Y linear between
/// the rows. A component's values are `stride` apart.
#include <cstddef>

namespace wienertree {

struct RowIntegrals {
  double i0 = 0, j1 = 0, j2 = 0;  ///< int U du, int (u - t_0) U du, int (u - t_0)^2 U du
};

RowIntegrals row_integrals(const double* t, const double* y, std::size_t stride, std::size_t gaps);

/// int U_a U_b du for two components.
double row_products(const double* t, const double* a, const double* b, std::size_t stride, std::size_t gaps);

/// sum delta^2/6 over the gaps: the integral of the variance of a Brownian bridge on each.
double row_bridge_variance(const double* t, std::size_t gaps);

}  // namespace wienertree
