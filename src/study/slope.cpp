#include "wienertree/study/slope.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "wienertree/numeric/error.hpp"
#include "wienertree/study/error_measure.hpp"

namespace wienertree {

double SlopeFit::at(double x) const { return std::exp(intercept + slope * std::log(x)); }

double SlopeFit::band(double x) const {
  const double from_mean = std::log(x) - mean_log_x;
  return std::exp(reach * std::sqrt(1 / static_cast<double>(points) + from_mean * from_mean / square_log_x));
}

SlopeFit fit_slope(std::span<const double> x, std::span<const double> y, double level) {
  if (x.size() != y.size() || x.size() < 2)
    throw InputError("a slope needs two points or more", "slope", std::to_string(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(x[i] > 0 && y[i] > 0 && std::isfinite(x[i]) && std::isfinite(y[i])))
      throw InputError("a slope in logarithms needs positive, finite points", "slope",
                       fmt::format("({}, {})", x[i], y[i]));
  SlopeFit fit;
  fit.points = x.size();
  const auto n = static_cast<double>(x.size());
  double mean_log_y = 0, products = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    fit.mean_log_x += std::log(x[i]) / n;
    mean_log_y += std::log(y[i]) / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = std::log(x[i]) - fit.mean_log_x;
    fit.square_log_x += dx * dx;
    products += dx * (std::log(y[i]) - mean_log_y);
  }
  if (!(fit.square_log_x > 0))
    throw InputError("a slope needs two different x", "slope", fmt::format("{}", x[0]));
  fit.slope = products / fit.square_log_x;
  fit.intercept = mean_log_y - fit.slope * fit.mean_log_x;
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    squares += std::pow(std::log(y[i]) - fit.intercept - fit.slope * std::log(x[i]), 2);
  fit.reach = x.size() == 2 ? std::numeric_limits<double>::quiet_NaN()
                            : student_quantile(level, x.size() - 2) * std::sqrt(squares / (n - 2));
  const double half = fit.reach / std::sqrt(fit.square_log_x);
  fit.slope_low = fit.slope - half;
  fit.slope_high = fit.slope + half;
  return fit;
}

}  // namespace wienertree
