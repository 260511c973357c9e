#pragma once
/// Newton's matrix I - gamma J of a batch: one d x d block a node, factored for all nodes at once.
#include <cstdint>
#include <vector>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// LU factors with partial pivoting of the blocks of up to `capacity` nodes, as a structure of arrays: entry
/// (i, l) of all blocks is contiguous.
class BlockDiagonalLU {
 public:
  BlockDiagonalLU(std::size_t dimension, std::size_t capacity);

  /// Factors I - gamma J.   jacobian(i*d + l, n) = J_il of node n: d*d x N, N <= capacity.
  /// Returns false when a block is singular or not finite; `solve` must not be called then.
  bool factor(double gamma, ConstBatchView jacobian);
  /// Replaces x by the solution of (I - gamma J) y = x.   x: d x N, N as factored.
  void solve(BatchView x) const;

 private:
  double* entry(std::size_t i, std::size_t l) { return factors_.data() + (i * dimension_ + l) * capacity_; }
  const double* entry(std::size_t i, std::size_t l) const {
    return factors_.data() + (i * dimension_ + l) * capacity_;
  }
  /// Whether rows k and r of a node's block were exchanged while column k was eliminated, k < r.
  std::uint8_t* exchanged(std::size_t k, std::size_t r) {
    return exchanged_.data() + (k * dimension_ + r) * capacity_;
  }
  const std::uint8_t* exchanged(std::size_t k, std::size_t r) const {
    return exchanged_.data() + (k * dimension_ + r) * capacity_;
  }

  std::size_t dimension_, capacity_;
  std::vector<double>
      factors_;  // unit lower triangle below, inverse pivots on, upper triangle above the diagonal
  std::vector<std::uint8_t> exchanged_;
};

}  // namespace wienertree
