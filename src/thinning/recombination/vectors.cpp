#include "wienertree/thinning/recombination/vectors.hpp"

#include <cmath>

#include "wienertree/numeric/clones.hpp"

namespace wienertree::recombination {

WIENERTREE_CLONES MeanDeviation mean_deviation(const double* x, const double* w, std::size_t n) {
  const double mass = lane_total(w, n), mean = lane_dot(w, x, n) / mass;
  const double square = lane_sum_of_loads(
      n, [&]<class V>(std::size_t i, V & term) __attribute__((always_inline)) {
        V distance;
        load_lanes(x + i, distance);
        distance -= mean;
        load_lanes(w + i, term);
        term *= distance * distance;
      });
  return {mean, std::sqrt(square / mass)};
}

}  // namespace wienertree::recombination
