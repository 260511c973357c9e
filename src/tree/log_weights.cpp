#include "wienertree/tree/log_weights.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>

#include "wienertree/tree/clones.hpp"
#include "wienertree/tree/elementary.hpp"
#include "wienertree/tree/lane_sum.hpp"

namespace wienertree {

WIENERTREE_CLONES LargestLogWeight largest_log_weight(std::span<const double> log_weight) {
  const double* a = log_weight.data();
  const std::size_t n = log_weight.size();
  std::array<double, sum_lanes> largest;
  std::array<std::uint64_t, sum_lanes> invalid{};
  largest.fill(-std::numeric_limits<double>::infinity());
  const auto visit = [&](std::size_t l, double x) {
    largest[l] = x > largest[l] ? x : largest[l];
    invalid[l] |= x <= std::numeric_limits<double>::max() ? 0 : 1;
  };
  std::size_t i = 0;
  for (; i + sum_lanes <= n; i += sum_lanes)
    for (std::size_t l = 0; l < sum_lanes; ++l) visit(l, a[i + l]);
  for (; i < n; ++i) visit(0, a[i]);
  return {*std::max_element(largest.begin(), largest.end()),
          std::accumulate(invalid.begin(), invalid.end(), std::uint64_t{0}) == 0};
}

WIENERTREE_CLONES double relative_weights(std::span<const double> log_weight, double largest, double* w) {
  const double* a = log_weight.data();
  return lane_sum(0, log_weight.size(),
                  [&](std::size_t i) { return w[i] = elementary::exp_nonpositive(a[i] - largest); });
}

WIENERTREE_CLONES double sum_of_squares(std::span<const double> weight) {
  const double* w = weight.data();
  return lane_sum(0, weight.size(), [&](std::size_t i) { return w[i] * w[i]; });
}

}  // namespace wienertree
