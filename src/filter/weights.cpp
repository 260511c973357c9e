#include "wienertree/filter/weights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "wienertree/filter/places.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

[[noreturn]] void refuse(std::span<const double> log_weight, const std::string& where) {
  const auto bad = std::find_if(log_weight.begin(), log_weight.end(),
                                [](double w) { return std::isnan(w) || w == infinity; });
  if (bad == log_weight.end())
    throw RunError("no node has positive weight", where, fmt::format("{} nodes", log_weight.size()));
  throw RunError("the weight of a node is not finite",
                 fmt::format("{}, node {}", where, bad - log_weight.begin()),
                 fmt::format("log-weight {}", *bad));
}

}  // namespace

void check_log_weights(std::span<const double> log_weight, const ObservationWindow& window) {
  const LargestLogWeight largest = largest_log_weight(log_weight);
  if (!largest.all_valid || largest.value == -infinity) refuse(log_weight, place_and_observation(window));
}

void NormalisedWeights::assign(std::span<const double> a, std::span<const double> b, std::size_t step,
                               double time) {
  weight.assign(a.begin(), a.end());
  for (std::size_t n = 0; n < b.size(); ++n) weight[n] += b[n];
  const LargestLogWeight found = largest_log_weight(weight);
  const double largest = found.value;
  if (!found.all_valid || largest == -infinity) refuse(weight, fmt::format("step {}, t = {:g}", step, time));
  const double sum = relative_weights(weight, largest, weight.data());
  const double squares = sum_of_squares(weight);
  for (double& w : weight) w /= sum;
  log_mass = largest + std::log(sum);
  effective_size = sum * sum / squares;
}

}  // namespace wienertree
