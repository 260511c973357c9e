#include "wienertree/weak/step_law.hpp"

#include <algorithm>
#include <cmath>

namespace wienertree {
namespace {

// The root of 6 c - 4 c^3 = gamma in |c| < 1/sqrt 2, where the left side increases to 2 sqrt 2: with
// c = sqrt 2 sin t it is 2 sqrt 2 sin 3t.
double skewness_coefficient(double gamma) {
  return std::sqrt(2.0) * std::sin(std::asin(gamma / (2 * std::sqrt(2.0))) / 3);
}

// Newton's method on Fleishman's equations for (B, c, d); whether it converged.
bool four_moments(double gamma, double excess, StepLaw& law) {
  double B = law.b, c = law.c, d = excess / 24;
  for (int iteration = 0; iteration < 30; ++iteration) {
    const double f[3] = {B * B + 6 * B * d + 2 * c * c + 15 * d * d - 1,
                         2 * c * (B * B + 24 * B * d + 105 * d * d + 2) - gamma,
                         24 * (B * d + c * c * (1 + B * B + 28 * B * d) +
                               d * d * (12 + 48 * B * d + 141 * c * c + 225 * d * d)) -
                             excess};
    const double J[3][3] = {
        {2 * B + 6 * d, 4 * c, 6 * B + 30 * d},
        {2 * c * (2 * B + 24 * d), 2 * (B * B + 24 * B * d + 105 * d * d + 2), 2 * c * (24 * B + 210 * d)},
        {24 * (d + c * c * (2 * B + 28 * d) + 48 * d * d * d),
         24 * (2 * c * (1 + B * B + 28 * B * d) + 282 * c * d * d),
         24 * (B + 28 * B * c * c + 24 * d + 144 * B * d * d + 282 * c * c * d + 900 * d * d * d)}};
    const auto minor = [&](int r, int s, int i, int j) { return J[r][i] * J[s][j] - J[r][j] * J[s][i]; };
    const double det =
        J[0][0] * minor(1, 2, 1, 2) - J[0][1] * minor(1, 2, 0, 2) + J[0][2] * minor(1, 2, 0, 1);
    if (!(std::abs(det) > 1e-12)) return false;
    // Cramer's rule.
    const auto solved = [&](int column) {
      double A[3][3];
      for (int r = 0; r < 3; ++r)
        for (int s = 0; s < 3; ++s) A[r][s] = s == column ? f[r] : J[r][s];
      return (A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) -
              A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0]) +
              A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0])) /
             det;
    };
    const double dB = solved(0), dc = solved(1), dd = solved(2);
    B -= dB, c -= dc, d -= dd;
    if (!std::isfinite(B + c + d)) return false;
    if (std::abs(dB) + std::abs(dc) + std::abs(dd) < 1e-14) {
      law.b = B + 3 * d, law.c = c, law.d = d;
      return !(law.b < 0.3) && std::abs(c) <= 0.35 && std::abs(d) <= 0.2;
    }
  }
  return false;
}

}  // namespace

StepLaw step_law(std::span<const double> u, std::span<const double> w, bool four) {
  double mass = 0, mean = 0, largest = 0;
  for (std::size_t j = 0; j < u.size(); ++j) mass += w[j], largest = std::max(largest, std::abs(u[j]));
  for (std::size_t j = 0; j < u.size(); ++j) mean += w[j] * (u[j] - u[0]) / mass;
  mean += u[0];
  double k2 = 0, k3 = 0, k4 = 0;
  for (std::size_t j = 0; j < u.size(); ++j) {
    const double x = u[j] - mean, square = x * x * w[j] / mass;
    k2 += square, k3 += square * x, k4 += square * x * x;
  }
  StepLaw law;
  law.mean = mean;
  // Differences of the size of rounding are none.
  if (!(k2 > 1e-28 * largest * largest)) return law;
  law.deviation = std::sqrt(k2);
  const double gamma = std::clamp(k3 / (k2 * law.deviation), -2.6, 2.6), excess = k4 / (k2 * k2) - 3;
  law.c = skewness_coefficient(gamma);
  law.b = std::sqrt(1 - 2 * law.c * law.c);
  if (!four) return law;
  StepLaw better = law;
  return four_moments(gamma, excess, better) ? better : law;
}

Crossings crossings(const StepLaw& law, double value, double reach) {
  const double target = law.deviation > 0 ? (value - law.mean) / law.deviation : 0;
  if (!(law.deviation > 0)) return {};
  // No z with |z| < reach gets there.
  if (std::abs(target) > std::abs(law.b) * reach + std::abs(law.c) * (reach * reach + 1) +
                             std::abs(law.d) * reach * (reach * reach + 3))
    return {};
  // Between the zeros of the derivative b - 3 d + 2 c z + 3 d z^2 the law is monotone.
  std::array<double, 4> end{-reach, reach, reach, reach};
  std::size_t ends = 1;
  const double A = 3 * law.d, B = 2 * law.c, C = law.b - 3 * law.d;
  const auto add = [&](double z) {
    if (z > end[ends - 1] && z < reach) end[ends++] = z;
  };
  if (std::abs(A) > 1e-12) {
    const double discriminant = B * B - 4 * A * C;
    if (discriminant > 0) {
      const double root = std::sqrt(discriminant);
      const double z1 = (-B - root) / (2 * A), z2 = (-B + root) / (2 * A);
      add(std::min(z1, z2));
      add(std::max(z1, z2));
    }
  } else if (B != 0) {
    add(-C / B);
  }
  end[ends] = reach;
  Crossings found;
  for (std::size_t i = 0; i < ends; ++i) {
    double low = end[i], high = end[i + 1];
    const double f_low = law.standard(low) - target;
    if ((f_low < 0) == (law.standard(high) - target < 0)) continue;
    // Newton's method, or the middle where it leaves what is left of the bracket.
    double z = 0.5 * (low + high);
    for (int k = 0; k < 60; ++k) {
      const double f = law.standard(z) - target, step = f / (C + z * (B + z * A));
      if (f == 0 || std::abs(step) <= 1e-15 * reach || high - low <= 1e-15 * reach) break;
      ((f < 0) == (f_low < 0) ? low : high) = z;
      z = z - step > low && z - step < high ? z - step : 0.5 * (low + high);
    }
    found.z[found.count++] = z;
  }
  return found;
}

}  // namespace wienertree
