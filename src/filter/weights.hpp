#pragma once
/// From log-weights to weights.
#include <span>
#include <vector>

#include "wienertree/filter/window.hpp"

namespace wienertree {

/// @throws RunError naming the step and the observation if no log-weight is above -infinity, or one is NaN or
/// +infinity
void check_log_weights(std::span<const double> log_weight, const ObservationWindow& window);

/// Weights exp(a_n + b_n - log_mass), which sum to 1, and log_mass = log sum exp(a_n + b_n).
struct NormalisedWeights {
  std::vector<double> weight;
  double log_mass = 0;
  double effective_size = 0;  ///< 1/sum weight^2
  /// @param a N log-weights  @param b N, or empty for zeros  @param step, time for the message
  /// @throws RunError if the weights are all zero, or one is NaN or +infinity: naming the node
  void assign(std::span<const double> a, std::span<const double> b, std::size_t step, double time);
};

}  // namespace wienertree
