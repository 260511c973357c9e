#include "wienertree/model/jacobi.hpp"

#include <cmath>

namespace wienertree {

std::optional<JacobiProcess> jacobi_process(const Model& model) {
  if (model.state_dimension() != 1 || model.has_clock || model.initial_law) return std::nullopt;
  const auto [lower, upper, boundary] = model.bounds[0];
  const double width = upper - lower, start = model.initial[0];
  if (!std::isfinite(width) || !(width > 0) || !(start >= lower && start <= upper)) return std::nullopt;
  constexpr std::size_t points = 1001;
  const std::size_t p = model.noise_dimension();
  Batch x(1, points), drift(1, points), noise(p, points);
  for (std::size_t n = 0; n < points; ++n)
    x(0, n) = lower + width * static_cast<double>(n) / static_cast<double>(points - 1);
  model.fields->ito_drift(x, drift);
  model.fields->diffusion(x, noise);
  const auto variance = [&](std::size_t n) {
    double sum = 0;
    for (std::size_t j = 0; j < p; ++j) sum += noise(j, n) * noise(j, n);
    return sum;
  };
  // From the values a quarter of the way from both ends.
  constexpr std::size_t first = (points - 1) / 4, last = 3 * first;
  JacobiProcess result{0, 0, 0, lower, upper};
  result.b = (drift(0, last) - drift(0, first)) / (x(0, last) - x(0, first));
  result.a = drift(0, first) - result.b * x(0, first);
  result.c = variance(first) / ((x(0, first) - lower) * (upper - x(0, first)));
  if (!(result.c > 0) || !std::isfinite(result.c) || !std::isfinite(result.a + result.b)) return std::nullopt;
  const double size = std::abs(result.a) + std::abs(result.b) * (std::abs(lower) + std::abs(upper));
  constexpr double rounding = 1e-12;
  for (std::size_t n = 0; n < points; ++n) {
    const double at = x(0, n), square = result.c * (at - lower) * (upper - at);
    if (!(std::abs(drift(0, n) - result.a - result.b * at) <= rounding * size) ||
        !(std::abs(variance(n) - square) <= rounding * result.c * width * width))
      return std::nullopt;
  }
  if (result.a + result.b * lower < -rounding * size || result.a + result.b * upper > rounding * size)
    return std::nullopt;
  return result;
}

}  // namespace wienertree
