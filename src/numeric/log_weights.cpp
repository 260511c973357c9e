#include "wienertree/numeric/log_weights.hpp"

#include <algorithm>
#include <limits>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/elementary.hpp"
#include "wienertree/numeric/lane_sum.hpp"

namespace wienertree {

WIENERTREE_CLONES LargestLogWeight largest_log_weight(std::span<const double> log_weight) {
  const double* a = log_weight.data();
  const std::size_t n = log_weight.size();
  constexpr double most = std::numeric_limits<double>::max();
  SumLanes largest = SumLanes{} - std::numeric_limits<double>::infinity(), x;
  auto valid = largest <= most, positive = valid;
  std::size_t i = 0;
  for (; i + sum_lanes <= n; i += sum_lanes) {
    load_lanes(a + i, x);
    largest = x > largest ? x : largest;
    valid &= x <= most;
    positive &= x >= -most;
  }
  LargestLogWeight all{-std::numeric_limits<double>::infinity(), true, true};
  for (std::size_t l = 0; l < sum_lanes; ++l) {
    all.value = std::max(all.value, largest[l]);
    all.all_valid &= valid[l] != 0;
    all.all_positive &= positive[l] != 0;
  }
  for (; i < n; ++i) {
    all.value = a[i] > all.value ? a[i] : all.value;
    all.all_valid &= a[i] <= most;
    all.all_positive &= a[i] >= -most;
  }
  all.all_positive &= all.all_valid;
  return all;
}

WIENERTREE_CLONES double relative_weights(std::span<const double> log_weight, double largest, double* w) {
  const double* a = log_weight.data();
  return lane_sum(0, log_weight.size(),
                  [&](std::size_t i) { return w[i] = elementary::exp_nonpositive(a[i] - largest); });
}

WIENERTREE_CLONES double sum_of_squares(std::span<const double> w) {
  return lane_dot(w.data(), w.data(), w.size());
}

}  // namespace wienertree
