#pragma once
/// Thinning on the line for families that must overlap.
#include <span>
#include <vector>

#include "wienertree/thinning/recombination/gauss.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// Patches of equal width in xi = int dx / s(x), where s(x) is the standard deviation that the family of a node at x
/// will have: each becomes its Gauss quadrature of 6 nodes, which keeps its moments to degree 11. What is integrated
/// later, a smooth function convolved with families, is analytic on the scale of s. Patches are 6 s wide at most (nodes
/// then lie about s apart, and a sum of Gaussians one standard deviation apart ripples by 2 exp(-2 pi^2) = 5e-9 of its
/// density), and narrower where that leaves fewer than N nodes; at most 512 nodes whatever the width.
class OverlappingNodes {
 public:
  /// @param from points with log-weights; further components are constant  @param spread s > 0 at each, or 0 where
  /// there is no noise, which counts as a thousandth of the largest
  /// @param nodes N  @param out states and log-weights of the nodes, ascending
  void thin(const Generation& from, std::span<const double> spread, std::size_t nodes, Generation& out);

 private:
  struct Point {
    double x, log_weight, spread;
  };
  void reduce(std::size_t first, std::size_t last);

  std::vector<Point> points_;
  std::vector<double> xi_, z_, w_, x_, log_weight_;
  recombination::DiscreteGauss gauss_;
};

}  // namespace wienertree
