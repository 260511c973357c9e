#include "wienertree/filter/bounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/places.hpp"
#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/lane_sum.hpp"

namespace wienertree {
namespace {

WIENERTREE_CLONES bool all_within(std::span<const double> x, double lower, double upper) {
  const double* v = x.data();
  const auto outside = [&](std::size_t n) { return ((v[n] >= lower) & (v[n] <= upper)) ? 0.0 : 1.0; };
  return lane_sum(0, x.size(), outside) == 0.0;
}

void keep_component(const Model& model, const ObservationWindow& window, std::size_t i, std::size_t first,
                    std::span<double> x) {
  constexpr double largest = std::numeric_limits<double>::max();
  const StateBound& b = model.bounds[i];
  if (b.bounded() && b.boundary != Boundary::error)
    for (double& v : x) v = v < b.lower ? b.lower : v > b.upper ? b.upper : v;  // NaN stays
  const double lower = std::max(b.lower, -largest), upper = std::min(b.upper, largest);
  const auto inside = [&](double v) { return (v >= lower) & (v <= upper); };
  if (all_within(x, lower, upper)) return;
  const auto n = static_cast<std::size_t>(std::find_if_not(x.begin(), x.end(), inside) - x.begin());
  throw RunError(
      std::isfinite(x[n]) ? "a particle left the state's bounds" : "a particle's state is not finite",
      fmt::format("{}, particle {}, state {}", place(window), first + n, model.state_names[i]),
      fmt::format("{}", x[n]));
}

}  // namespace

void keep_inside_bounds(const Model& model, const ObservationWindow& window, std::size_t first, BatchView x) {
  for (std::size_t i = 0; i < x.components(); ++i) keep_component(model, window, i, first, x.component(i));
}

}  // namespace wienertree
