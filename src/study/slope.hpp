#pragma once
/// Orders of convergence: straight lines through points in logarithmic coordinates.
#include <cstddef>
#include <span>

namespace wienertree {

/// log y = intercept + slope log x + e by least squares, e independent with one variance.
struct SlopeFit {
  double slope = 0, intercept = 0;
  double slope_low = 0,
         slope_high = 0;  ///< Student's confidence interval; NaN for two points, which a line meets exactly
  std::size_t points = 0;

  double at(double x) const;
  /// Factor f >= 1 such that [at(x)/f, at(x) f] is the confidence interval of the line at x; NaN for two
  /// points.
  double band(double x) const;

  double mean_log_x = 0, square_log_x = 0;  ///< mean of log x, sum of (log x - mean)^2
  double reach = 0;                         ///< Student's quantile times the standard deviation of e
};

/// @throws InputError unless there are two points or more, all positive and finite, with two different x
SlopeFit fit_slope(std::span<const double> x, std::span<const double> y, double level = 0.95);

}  // namespace wienertree
