#pragma once
/// The order in which the random methods visit the sites. In spatial order neighbouring particles come from
/// neighbouring sites, and the error of a mean falls faster than N^{-1/2}: Hammersley's remark for d = 1;
/// Gerber, Chopin (2015), "Sequential quasi Monte Carlo", J. R. Stat. Soc. B 77, 509-579, for Hilbert's
/// curve.
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "wienertree/numeric/hilbert.hpp"
#include "wienertree/numeric/prefix_sort.hpp"
#include "wienertree/thinning/masses.hpp"
#include "wienertree/thinning/thinning.hpp"

namespace wienertree {

/// Orders sites whose log-weight is not -infinity; reuses its buffers from call to call.
class SiteOrdering {
 public:
  /// Parent by parent, branch by branch; storage order if sites.parents is 0.
  /// @throws InputError if sites.parents does not divide the number of sites
  void tree(const Sites& sites, Buffer<std::uint32_t>& visit);

  /// Sorted in space, equal positions by index. Components that are constant over the sites do not count. If
  /// one varies, exactly by its value. If k >= 2 vary, along a Hilbert curve over a grid of 2^min(16, [64/k])
  /// cells a side, laid for each component between its weighted quantiles 1/64 and 63/64 widened by their
  /// distance at both ends; what lies outside counts as on the border, so that a few outliers cost no
  /// resolution.
  /// @param masses of the same sites
  /// @throws RunError naming the first site of positive weight whose state is not finite
  /// @throws InputError if more than 64 components vary
  void spatial(const Sites& sites, const ParticleMasses& masses, Buffer<std::uint32_t>& visit);

  /// Memory of the last sort, which is free until the next one.
  Buffer<std::uint64_t>& workspace() { return scratch_; }

 private:
  struct Axis {
    std::size_t component;
    double low, scale;  ///< cell of x on a side of n cells: (x/4 - low) scale n, within 0..n-1
  };
  struct Range {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    bool finite = true;
  };
  // site(i), i = 0..live-1: the sites of positive weight by ascending index.
  template <class Site>
  void sort_in_space(const Sites& sites, std::size_t live, Site site, Buffer<std::uint32_t>& visit);
  template <class Site>
  bool make_axis(const Sites& sites, std::size_t live, Site site, std::size_t component, Axis& axis);
  template <class Site>
  ItemLayout line_items(const Sites& sites, std::size_t live, Site site);
  template <class Site>
  ItemLayout curve_items(const Sites& sites, std::size_t live, Site site);
  void draw_sample(const ParticleMasses& masses);

  std::vector<Axis> axes_;
  std::vector<Range> range_;       ///< each block of sites
  std::vector<std::size_t> live_;  ///< likewise
  std::vector<std::uint32_t> sample_;
  std::vector<double> sample_values_;
  Buffer<std::uint64_t> items_, scratch_, keys_;
};

}  // namespace wienertree
