#pragma once
/// From log-weights to weights, many at once.
#include <cstddef>
#include <span>

namespace wienertree {

struct LargestLogWeight {
  double value;       ///< -infinity if there is none above
  bool all_valid;     ///< no NaN, no +infinity
  bool all_positive;  ///< nor -infinity
};

LargestLogWeight largest_log_weight(std::span<const double> log_weight);

/// w_i = exp(log_weight_i - largest), 0 below exp(-700), to 2 ulp; returns their sum. The same bits on all
/// processors.
/// @pre largest >= log_weight_i, finite; w has room for as many values, and may be log_weight itself
double relative_weights(std::span<const double> log_weight, double largest, double* w);

/// sum w_i^2
double sum_of_squares(std::span<const double> w);

}  // namespace wienertree
