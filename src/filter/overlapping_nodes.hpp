#pragma once
/// Thinning on the line for families that must overlap.
#include <span>
#include <vector>

#include "wienertree/thinning/recombination/gauss.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// Patches in xi = int dx / s(x), where s(x) is the standard deviation that the family of a node at x will
/// have: each becomes its Gauss quadrature of 6 nodes, which keeps its moments to degree 11. What is integrated
/// later, a smooth function convolved with families, is analytic on the scale of s. Patches are at most b = 4 wide:
/// Gauss's rule of 6 nodes then integrates the density phi of one family over a patch to
///
///     b^13 (6!)^4 / (13 (12!)^3) max |phi^(12)| = 1.3e-4 phi(0),   max |phi^(12)| = 11!! phi(0),
///
/// where b = 6 would leave 2.6e-2, which is seen in the evidence as soon as the noise is narrower than a family.
/// The tails beyond 1e-40 of the mass are a patch each. Patches are made narrower where that leaves fewer than N
/// nodes, and wider where it makes more than 512.
class OverlappingNodes {
 public:
  /// @param from points with log-weights; further components are constant  @param spread s > 0 at each, or 0
  /// where there is no noise, which counts as a thousandth of the largest
  /// @param nodes N  @param out states and log-weights of the nodes, ascending
  void thin(const Generation& from, std::span<const double> spread, std::size_t nodes, Generation& out);

 private:
  struct Point {
    double x, log_weight, spread;
  };
  void sort(const Generation& from, std::span<const double> spread);
  void cut(std::size_t first, std::size_t last, double width);
  void reduce(std::size_t first, std::size_t last);

  std::vector<Point> points_;
  std::vector<std::size_t> end_;  ///< of patches
  std::vector<double> weight_, xi_, z_, w_, x_, log_weight_;
  recombination::DiscreteGauss gauss_;
};

}  // namespace wienertree
