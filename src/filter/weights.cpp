#include "wienertree/filter/weights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/model/error.hpp"

namespace wienertree {

void NormalisedWeights::assign(std::span<const double> a, std::span<const double> b,
                               const std::string& where) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  weight.resize(a.size());
  double largest = -infinity;
  for (std::size_t n = 0; n < a.size(); ++n) {
    weight[n] = a[n] + (b.empty() ? 0.0 : b[n]);
    largest = std::max(largest, weight[n]);
  }
  double sum = 0, squares = 0;
  if (largest > -infinity && largest < infinity)
    for (double& w : weight) {
      w = std::exp(w - largest);
      sum += w;
      squares += w * w;
    }
  if (!std::isfinite(sum) || largest == infinity) {
    const auto bad =
        std::find_if(a.begin(), a.end(), [](double w) { return std::isnan(w) || w == infinity; });
    throw RunError("the weight of a node is not finite", fmt::format("{}, node {}", where, bad - a.begin()),
                   bad == a.end() ? std::string() : fmt::format("log-weight {}", *bad));
  }
  if (!(sum > 0)) throw RunError("no node has positive weight", where, fmt::format("{} nodes", a.size()));
  for (double& w : weight) w /= sum;
  log_mass = largest + std::log(sum);
  effective_size = sum * sum / squares;
}

}  // namespace wienertree
