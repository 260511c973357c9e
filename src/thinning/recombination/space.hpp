#pragma once
/// Recombination where several components vary: Caratheodory reductions of the patches of a k-d tree.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/parallel.hpp"
#include "wienertree/thinning/recombination/caratheodory.hpp"
#include "wienertree/thinning/recombination/partition.hpp"

namespace wienertree::recombination {

struct KeptPoints {
  std::vector<std::uint32_t> point;  ///< patch by patch, ascending within a patch's order
  std::vector<double> log_weight;    ///< one per point
  double discarded = 0;              ///< as Selection::discarded
};

/// Where a patch's points go: room for as many as are kept at most.
struct PatchRoom {
  std::span<std::uint32_t> point;
  std::span<double> log_weight;
};

/// Reduces one patch at a time; what it holds is scratch.
class PatchReduction {
 public:
  struct Result {
    std::size_t kept;
    double discarded;  ///< in units of the weight exp(largest)
  };
  /// @param largest the largest of all log-weights
  /// @param x the points, whose moments are kept; the partition may have been cut in other coordinates
  /// @param unit the standard deviation of each component of x, or 1
  Result reduce(const SpacePartition& partition, ConstBatchView x, std::span<const double> unit,
                const Patch& patch, std::span<const double> log_weight, int degree, double largest,
                PatchRoom out);

 private:
  void fill_box(ConstBatchView x, std::span<const double> unit, std::span<const std::uint32_t> order);
  double keep_nearest_to_mean(double weight);
  const PolynomialBasis& basis(std::size_t dimension, int degree);

  Caratheodory caratheodory_;
  PatchPoints points_;
  std::vector<double> log_weight_;
  std::vector<double> half_, importance_;  ///< of the patch's box, in standard deviations; Taylor weights
  std::vector<std::unique_ptr<PolynomialBasis>> basis_;  ///< by dimension, all of degree basis_degree_
  int basis_degree_ = -1;
};

class SpaceRecombination {
 public:
  /// @param x components that vary, d >= 2 x n;  log_weight n values > -infinity;  n > budget
  /// @param degree r >= 0 with (d + r choose r) <= budget; r = 0 keeps the point nearest to a patch's mean
  /// @param cut_in d x n: coordinates that the patches are cut in
  /// @param threads to reduce patches on, if any
  void reduce(ConstBatchView x, ConstBatchView cut_in, std::span<const double> log_weight, int degree,
              std::size_t budget, ThreadPool* threads, KeptPoints& out);

 private:
  SpacePartition partition_;
  std::vector<double> unit_;
  std::vector<PatchReduction> reduction_;  ///< one a thread
  std::vector<std::size_t> first_;         ///< where each patch's points go
  std::vector<PatchReduction::Result> result_;
};

}  // namespace wienertree::recombination
