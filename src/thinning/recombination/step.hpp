#pragma once
/// One application of Caratheodory's theorem: n weighted points, q moments, n > q; q points of them suffice.
#include <cstddef>
#include <span>
#include <vector>

#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {

/// Weights W_j > 0 and moments b_aj of the points j = 1..n. A null vector v, sum_j b_aj v_j = 0 for all a,
/// may be added to the weights without changing sum_j b_aj W_j; the largest multiple that keeps them
/// non-negative, of either sign, brings one of them to zero (Tchernychova 2015, "Caratheodory cubature
/// measures", Oxford; Litterer, Lyons 2012, section 2). Here
/// - the null space is spanned by the last columns of Q in a Householder factorisation with column pivoting of the
///   n x q matrix b^T: exact to rounding whatever the condition of b;
/// - where that ends at rank rho < q, no combination of moments that is left exceeds n epsilon times the largest, and
///   rho points remain. (Moments of a whole generation, of which there are as many as nodes, are always dependent to
///   rounding from degree 12 or so on. Their rank must cost no more than the factorisation: a singular value
///   decomposition by rotations, which once stood here, took hundreds of times as long.)
/// - of the two multiples, the one is taken that keeps the discrepancy of further moments, not kept, smaller.
/// Buffers are reused from call to call.
class CaratheodoryStep {
 public:
  /// @param moments size x n row-major with stride padded(n), zeros beyond n; |entries| about 1. The first
  /// `kept` = q rows are to be kept, the others are the further moments
  /// @param weight n values, > 0; on return at most min(n, q) are > 0, the others 0
  /// @param discrepancy size - q values: the change of the further moments is added to them
  void reduce(const double* moments, std::size_t n, std::size_t kept, std::size_t size,
              std::span<double> weight, std::span<double> discrepancy);

  /// Multiplications with addition in all calls so far: at most about 4 n^2 (q + further) each.
  double operations() const { return operations_; }

 private:
  std::size_t factorise(std::size_t rows);
  void null_space(const double* further_moments, std::size_t further, std::size_t rank);
  void eliminate(std::span<double> weight, std::span<double> discrepancy);

  double operations_ = 0;
  std::size_t points_ = 0, stride_ = 0;        ///< n, padded(n)
  std::size_t nullity_ = 0, null_stride_ = 0;  ///< null vectors, each followed by its further moments
  std::vector<double> rows_;                   ///< what is factorised: vectors over the points
  std::vector<double> reflector_, scale_;      ///< H_k = I - scale_k v_k v_k^T, v_k zero before entry k
  std::vector<double> norm_, norm_reference_;  ///< squares
  std::vector<double> null_, down_, up_;
};

}  // namespace wienertree::recombination
