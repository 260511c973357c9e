#include "wienertree/filter/noise_overlap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/quadrature/exp_sinh.hpp>
#include <boost/math/quadrature/tanh_sinh.hpp>
#include <cmath>
#include <limits>

namespace wienertree {
namespace {

double laplace_overlap(double a, double b) {
  const double u = std::min(std::fabs(a), std::fabs(b)), v = std::max(std::fabs(a), std::fabs(b));
  if ((a < 0) != (b < 0)) return std::exp(-u) + std::exp(-v) - std::exp(-u - v);
  return std::exp(u) + (std::exp(-u - v) - std::exp(2 * u - v)) / 3;
}

}  // namespace

double noise_overlap(const NoiseLaw& law, double a, double b) {
  switch (law.kind) {
    case NoiseLaw::Kind::gaussian:
      return std::exp(a * b / (law.scale * law.scale));
    case NoiseLaw::Kind::laplace:
      return laplace_overlap(a / law.scale, b / law.scale);
    case NoiseLaw::Kind::log_chi_square: {
      const double rate = std::exp(-a) + std::exp(-b) - 1;
      return rate > 0 ? std::exp(-(a + b) / 2) / std::sqrt(rate) : std::numeric_limits<double>::infinity();
    }
    case NoiseLaw::Kind::student_t:
      break;
  }
  return noise_overlap_by_quadrature(law, a, b);
}

// The integrand is smooth between the kinks 0, a, b; beyond them it falls.
double noise_overlap_by_quadrature(const NoiseLaw& law, double a, double b) {
  const auto integrand = [&](double y) {
    const double value = std::exp(log_noise(law, y - a) + log_noise(law, y - b) - log_noise(law, y));
    return std::isnan(value) ? 0.0 : value;  // far out, where all three densities vanish
  };
  constexpr double tolerance = 1e-10;
  std::array<double, 3> kinks = {0.0, a, b};
  std::sort(kinks.begin(), kinks.end());
  try {
    boost::math::quadrature::exp_sinh<double> half_line;
    boost::math::quadrature::tanh_sinh<double> interval;
    double sum = half_line.integrate([&](double z) { return integrand(kinks[0] - z); }, tolerance) +
                 half_line.integrate([&](double z) { return integrand(kinks[2] + z); }, tolerance);
    for (std::size_t i = 0; i < 2; ++i)
      if (kinks[i + 1] > kinks[i]) sum += interval.integrate(integrand, kinks[i], kinks[i + 1], tolerance);
    if (std::isfinite(sum)) return sum;
  } catch (const std::exception&) {
  }
  throw RunError("the overlap of the noise does not converge", "noise_overlap", fmt::format("{}, {}", a, b));
}

}  // namespace wienertree
