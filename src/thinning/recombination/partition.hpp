#pragma once
/// Space cut into patches by a k-d tree that follows the mass.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace wienertree::recombination {

/// Points begin..end-1 of the partition's order.
struct Patch {
  std::size_t begin = 0, end = 0;
  double error = 0;  ///< sum_j w_j |z_j - mean|^(r+1), on which the error of a reduction to degree r depends
  std::size_t axis = 0;  ///< component of largest sum_j w_j |z_j^i - mean^i|^(r+1)
  double cut = 0;        ///< the mean of that component
  std::size_t size() const { return end - begin; }
};

/// Starting from one patch, the one of largest error is cut in two at the mean of its widest component, in
/// the sense of the (r+1)-th moments, as long as the nodes that all patches will keep, min(points, q) each,
/// fit into the budget. Moments rather than extents measure width, so that a light tail is cut off where it
/// matters and a far point of no weight does not draw patches to itself. Should a cut leave less than 1/32 on
/// one side, it is moved to where 1/32 is: cost is O(points log points) for any weights.
class SpacePartition {
 public:
  /// Makes room for n points, whose components and weights are then to be written.
  void reset(std::size_t dimension, std::size_t points);
  std::size_t dimension() const { return dimension_; }
  std::span<double> component(std::size_t i) { return {z_.data() + i * points_, points_}; }
  std::span<const double> component(std::size_t i) const { return {z_.data() + i * points_, points_}; }
  std::span<double> weight() { return {weight_.data(), points_}; }

  /// Scales every component by its weighted standard deviation (units must not matter), and cuts.
  /// @pre total weight > 0
  void cut(int degree, std::size_t nodes_per_patch, std::size_t budget);

  /// Patches from left to right in the tree, and for every position the point that was written there.
  std::span<const Patch> patches() const { return patches_; }
  std::span<const std::uint32_t> order() const { return order_; }

 private:
  void scale();
  Patch measure(std::size_t begin, std::size_t end, int degree);
  std::size_t divide(const Patch& patch);
  std::size_t move_left(const Patch& patch, double cut, bool inclusive);

  std::size_t dimension_ = 0, points_ = 0;
  std::vector<double> z_, weight_, scratch_, moment_, mean_;
  std::vector<std::uint32_t> order_, order_scratch_;
  std::vector<std::uint8_t> left_;
  std::vector<Patch> open_, patches_;
};

}  // namespace wienertree::recombination
