#include "wienertree/tree/recombination_vectors.hpp"

#include <cmath>

#include "wienertree/tree/clones.hpp"

namespace wienertree::recombination {

WIENERTREE_CLONES MeanDeviation mean_deviation(const double* x, const double* w, std::size_t n) {
  const double mass = lane_sum(0, n, [&](std::size_t i) { return w[i]; });
  const double mean = lane_sum(0, n, [&](std::size_t i) { return w[i] * x[i]; }) / mass;
  const double square = lane_sum(0, n, [&](std::size_t i) { return w[i] * ((x[i] - mean) * (x[i] - mean)); });
  return {mean, std::sqrt(square / mass)};
}

}  // namespace wienertree::recombination
