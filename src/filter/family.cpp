#include "wienertree/filter/family.hpp"

#include <algorithm>
#include <cmath>

namespace wienertree {

FamilyShape FamilyShape::of(double skewness, double excess_kurtosis) {
  FamilyShape shape;
  shape.c = skewness / 6;
  shape.d = excess_kurtosis / 24 - skewness * skewness / 18;
  // With a near 1, |c| and |d| small, the slope a + 2 c z + 3 d (z^2 - 1) on |z| <= 4 is at least
  // a - 8 |c| - 45 max(-d, 0) - 3 max(d, 0).
  const double fall = 8 * std::abs(shape.c) + 45 * std::max(-shape.d, 0.0) + 3 * std::max(shape.d, 0.0);
  constexpr double most = 0.75;
  if (!(fall <= most)) {
    shape.c *= most / fall;
    shape.d *= most / fall;
  }
  shape.a = std::sqrt(1 - 2 * shape.c * shape.c - 6 * shape.d * shape.d);
  return shape;
}

// u(z) increases with a slope between 0.2 and 2, about z = u: Newton's step where it stays inside the bracket, else
// bisection.
double FamilyShape::inverse(double u) const {
  if (gaussian()) return u;
  double low = u - 1, high = u + 1;
  while ((*this)(low) > u) low -= 2 * (u - low);
  while ((*this)(high) < u) high += 2 * (high - u);
  double z = u;
  for (int k = 0; k < 80 && high - low > 1e-15 * (1 + std::abs(low)); ++k) {
    const double excess = (*this)(z)-u;
    (excess < 0 ? low : high) = z;
    const double step = excess / slope(z);
    if (std::abs(step) <= 1e-15 * (1 + std::abs(z))) return z;
    z = z - step > low && z - step < high ? z - step : low + (high - low) / 2;
  }
  return z;
}

void Families::clear() {
  log_weight.clear();
  mean.clear();
  sd.clear();
  shape.clear();
}

void Families::add(double log_weight_of_one, double mean_of_one, double sd_of_one) {
  log_weight.push_back(log_weight_of_one);
  mean.push_back(mean_of_one);
  sd.push_back(sd_of_one);
}

void Families::exchange(StateArchive& archive) {
  std::vector<double> a, c, d;
  for (const FamilyShape& s : shape) {
    a.push_back(s.a);
    c.push_back(s.c);
    d.push_back(s.d);
  }
  archive(log_weight, mean, sd, a, c, d);
  StateArchive::require(log_weight.size() == size() && sd.size() == size() && c.size() == a.size() &&
                        d.size() == a.size() && (a.empty() || a.size() == size()));
  shape.resize(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) shape[i] = {a[i], c[i], d[i]};
}

}  // namespace wienertree
