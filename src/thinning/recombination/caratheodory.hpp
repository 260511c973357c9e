#pragma once
/// Caratheodory's theorem for a patch of any number of points: divide and conquer.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "wienertree/thinning/recombination/polynomials.hpp"
#include "wienertree/thinning/recombination/step.hpp"

namespace wienertree::recombination {

/// Weighted points with a label each. `stride` is the room for points; the first `count` are there.
struct PatchPoints {
  std::size_t dimension = 0, stride = 0, count = 0;
  std::vector<double> z;             ///< component i of point j at i * stride + j, in [-1,1]
  std::vector<double> weight;        ///< > 0
  std::vector<std::uint32_t> label;  ///< never read, only carried

  /// Makes room for `most` points, keeping memory; contents are unspecified.
  void reserve(std::size_t dimension, std::size_t most);
};

/// n points to q moments in O(q n + q^3 log(n/q)): the points are put into 2q groups, the groups' barycentres
/// reduced to q of them by one `CaratheodoryStep`, the points of the others dropped, and so on with the half
/// that is left (Tchernychova 2015; Litterer, Lyons 2012, section 2). A group's new weight scales its
/// points'.
class Caratheodory {
 public:
  /// Keeps at most basis.kept() of the points, in their order, with new weights: the same integrals of the
  /// basis' kept polynomials. Points of less than 1e-300 times the total weight may go; the total is
  /// restored.
  /// @param importance weights, one for every polynomial of the first degree not kept, for what to disturb
  /// least
  /// @return sum of the changes of those polynomials' integrals times their weights, for total weight 1
  /// @pre basis.dimension() == points.dimension, points.count >= 1, weights about 1 at most
  double reduce(const PolynomialBasis& basis, std::span<const double> importance, PatchPoints& points);

  /// Multiplications with addition of all steps so far: O(q^3) each.
  double operations() const { return step_.operations(); }

 private:
  void group_moments(const PolynomialBasis& basis, const PatchPoints& points, std::size_t groups);
  void keep_groups(PatchPoints& points, std::size_t groups, double smallest);

  CaratheodoryStep step_;
  std::vector<double> moments_;  ///< size x groups, row-major with stride padded(groups)
  std::vector<double> weight_, before_, discrepancy_, scratch_, values_;
};

}  // namespace wienertree::recombination
