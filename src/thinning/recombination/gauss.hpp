#pragma once
/// Gauss quadrature of a discrete measure on the line.
#include <cstddef>
#include <span>
#include <vector>

namespace wienertree::recombination {

/// The s-node Gauss quadrature of sum_i w_i delta_{z_i}: exact for polynomials of degree 2s - 1, nodes within
/// the smallest interval that holds the points, weights >= 0.
///
/// Lanczos' iteration on diag(z), started at (sqrt w_i), builds the three-term recurrence of the measure's
/// orthonormal polynomials (Gragg, Harwood 1984, Numer. Math. 44, 317-335; Gautschi 2004, "Orthogonal
/// polynomials", section 2.2.3), every vector being orthogonalised against all before, which keeps the
/// recurrence right where s is not small against the number of points or the weights span many orders of
/// magnitude. Nodes and weights are the eigenvalues and squared first components of the eigenvectors of its
/// Jacobi matrix, by implicit QL (Golub, Welsch 1969, Math. Comp. 23, 221-230).
class DiscreteGauss {
 public:
  /// @param z in [-1,1]  @param w >= 0, same length, sum > 0
  /// @return the number of nodes, ascending in `nodes()` with `weights()` of sum 1: s, or fewer when the
  /// measure has fewer distinct points (to 1e-14) and these nodes are exact for all polynomials
  /// @throws RunError if QL does not converge
  std::size_t compute(std::span<const double> z, std::span<const double> w, std::size_t s);
  std::span<const double> nodes() const { return {diagonal_.data(), count_}; }
  std::span<const double> weights() const { return {first_.data(), count_}; }

  /// Integral of z^{2s} against the points less that against the nodes, for total weight 1: that of the
  /// square of the monic orthogonal polynomial of degree s, prod_{k=1..s} beta_k^2. 0 when the nodes are
  /// exact.
  double first_change() const { return first_change_; }

 private:
  void recurrence(std::span<const double> z, std::span<const double> w, std::size_t s);
  void eigenvalues();

  std::size_t count_ = 0;
  double first_change_ = 0;
  std::vector<double> vectors_, padded_, diagonal_, off_diagonal_, first_;
};

}  // namespace wienertree::recombination
