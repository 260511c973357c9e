#pragma once
/// The forward (Fokker-Planck) operator of a one-dimensional diffusion on a uniform grid.
#include <span>

#include "wienertree/filter/rational_exponential.hpp"

namespace wienertree {

/// n cells of equal width; densities are given at their midpoints.
struct LineGrid {
  double lower = 0, width = 1;  ///< of the first cell: its left end; of all cells: their width
  std::size_t cells = 0;
  double node(std::size_t i) const { return lower + (static_cast<double>(i) + 0.5) * width; }
  double upper() const { return lower + static_cast<double>(cells) * width; }
};

/// L* rho = -(b rho)' + (a rho)'' with a = sigma^2/2 as a matrix on densities at the nodes, in conservative
/// form: row i is -(F_{i+1/2} - F_{i-1/2})/w with the flux at the face between nodes i and i+1
///
///     F = sum_{k=1..m} c_k sum_{l=1-k..k} (b rho)_{i+l}
///         - (1/w) sum_{k=1..m} d_k sum_{l=0..k-1} ((a rho)_{i+k-l} - (a rho)_{i-l}),
///     c_k = (-1)^{k+1} m!^2 / (k (m-k)! (m+k)!),   d_k = 2 c_k / k,
///
/// so that away from the ends it is the central difference of order 2m = 8 (Fornberg 1988, Math. Comp. 51,
/// 699-706); nearer to an end m is the number of nodes beyond the face, and no flux passes the end itself.
/// Every column sums to zero: mass is conserved exactly. By the symmetry of the stencils, the transpose is
/// the central difference of order 8 of b f' + a f'': a test function is transported to that order whatever
/// the smoothness of rho, a point mass included.
/// @param drift b and @param variance sigma^2 at the nodes
void fokker_planck(const LineGrid& grid, std::span<const double> drift, std::span<const double> variance,
                   BandedMatrix& L);

/// c_1 .. c_m of the first derivative; those of the second are 2 c_k/k.
std::vector<double> central_difference(std::size_t m);

/// out = values, given at the nodes of `from`, at the nodes of `to`, by Lagrange's polynomial through the
/// eight nearest nodes; zero outside of `from`.
void interpolate(const LineGrid& from, std::span<const double> values, const LineGrid& to,
                 std::span<double> out);

/// The adjoint for a point: adds to `density` a unit mass at x, on the eight nearest nodes, with the mass and
/// the moments up to degree 7 of the point mass.
void deposit(const LineGrid& grid, double x, std::span<double> density);

}  // namespace wienertree
