#pragma once
/// A density on the line, on a uniform grid that follows its mass.
#include <span>
#include <vector>

#include "wienertree/filter/fokker_planck.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// Values at the nodes of a grid of constant size, zero outside. The support is where the density exceeds
/// 1e-14 of its largest value (8 standard deviations of a Gaussian). A grid laid anew is so wide that the
/// support covers 0.6 of it, with equal margins, but never passes the bounds of the state.
class LineDensity {
 public:
  /// @pre cells > 8, lowest < highest
  LineDensity(std::size_t cells, double lowest, double highest);

  const LineGrid& grid() const { return grid_; }
  std::span<double> values() { return values_; }
  std::span<const double> values() const { return values_; }
  double largest() const;
  double mass() const;
  void scale(double factor);

  /// N(mean, variance), of mass 1. @pre variance > 0
  void set_gaussian(double mean, double variance);
  /// A unit mass at x, on a grid laid around [x - reach, x + reach].
  void set_point(double x, double reach);
  /// Lays the grid anew around [low, high], with values interpolated from `other`; mass is that of `other`.
  void set_interpolated(const LineDensity& other, double low, double high);

  struct Support {
    std::size_t first, last;  ///< indices of nodes
  };
  Support support() const;
  double low() const { return grid_.node(support().first); }
  double high() const { return grid_.node(support().last); }
  /// Whether the support comes so near to an end that is no bound that mass may have been held up there.
  bool reaches_an_end() const;
  /// Whether the support reaches a bound of the state.
  bool touches_a_bound() const;
  /// Whether the support is so narrow that the grid is too coarse for it.
  bool is_narrow() const;
  /// Lays the grid anew where the support is narrow, wide, or near an end that is no bound. Returns whether
  /// it did.
  bool follow_mass();
  /// Makes the grid 1.6 times as wide, where the bounds allow.
  void widen();
  void exchange(StateArchive& archive);

  /// The density as sum_i weight_i N(point_i, width^2): masses at the nodes under width exp(-width^2/2
  /// d^2/dx^2), the inverse of the Gaussians' smoothing, up to width^8 with differences of order 8 and even
  /// continuation beyond a bound. A resolved density keeps its moments up to degree 9. Weights below zero,
  /// which rounding makes in the tails and a jump at a bound near it, become zero; the points are moved and
  /// stretched so that mean and variance are the density's in any case.   point, weight: as many as cells
  /// @pre the variance exceeds width^2
  void gaussian_sum(std::span<double> point, std::span<double> weight, std::vector<double>& scratch) const;

 private:
  void lay_around(double low, double high);
  bool has_room(Support support, double part) const;

  double lowest_, highest_;
  LineGrid grid_;
  bool at_lowest_ = false, at_highest_ = false;  // whether the grid ends at the bound
  std::vector<double> values_, laid_;
};

}  // namespace wienertree
