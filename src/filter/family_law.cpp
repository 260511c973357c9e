#include "wienertree/filter/family_law.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double negligible_coefficient = 1e-9;  // of the mass, in the norm of the Hermite polynomials
constexpr double negligible_weight = 1e-15;

double normal_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double normal_density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

// sum_{k >= first} c_k He_{k - first}(z)
double hermite_sum(std::span<const double> c, std::size_t first, double z) {
  double before = 0, now = 1, sum = 0;
  for (std::size_t k = first; k < c.size(); ++k) {
    sum += c[k] * now;
    const double next = z * now - static_cast<double>(k - first) * before;
    before = now;
    now = next;
  }
  return sum;
}

}  // namespace

void FamilyLaw::clear() {
  for (auto* v : {&log_weight_, &mean_, &sd_, &a_, &c_, &d_, &mu_, &s_, &numbers_, &weight_}) v->clear();
  first_.assign(1, 0);
  table_.clear();
}

void FamilyLaw::append(const Families& prior, std::size_t family, double log_weight, double mu, double s) {
  const FamilyShape shape = prior.shape_of(family);
  log_weight_.push_back(log_weight);
  mean_.push_back(prior.mean[family]);
  sd_.push_back(prior.sd[family]);
  a_.push_back(shape.a);
  c_.push_back(shape.c);
  d_.push_back(shape.d);
  mu_.push_back(mu);
  s_.push_back(s);
}

void FamilyLaw::add_smooth(const Families& prior, std::size_t family, double mu, double s, double log_weight,
                           const HermiteRule& rule, std::span<const double> log_ratio) {
  append(prior, family, log_weight, mu, s);
  table_.push_back(0);
  const std::size_t n = rule.size(), first = numbers_.size();
  const double largest = *std::max_element(log_ratio.begin(), log_ratio.end());
  numbers_.resize(first + n, 0.0);
  double* c = numbers_.data() + first;
  for (std::size_t j = 0; j < n; ++j) {
    const double r = rule.weight[j] * std::exp(log_ratio[j] - largest);
    double before = 0, now = r;  // r He_k(zeta_j)/k!
    for (std::size_t k = 0; k < n; ++k) {
      c[k] += now;
      const double next = (rule.z[j] * now - before) / static_cast<double>(k + 1);
      before = now;
      now = next;
    }
  }
  log_weight_.back() += largest + std::log(c[0]);
  double factorial = 1;
  std::size_t kept = 1;
  for (std::size_t k = 1; k < n; ++k) {
    c[k] /= c[0];
    factorial *= static_cast<double>(k);
    if (std::abs(c[k]) * std::sqrt(factorial) > negligible_coefficient) kept = k + 1;
  }
  c[0] = 1;
  numbers_.resize(first + kept);
  first_.push_back(numbers_.size());
}

void FamilyLaw::add_table(const Families& prior, std::size_t family, double log_weight,
                          std::span<const double> z, std::span<const double> below,
                          std::span<const double> density) {
  append(prior, family, log_weight, 0, 1);
  table_.push_back(1);
  for (const auto& column : {z, below, density})
    numbers_.insert(numbers_.end(), column.begin(), column.end());
  first_.push_back(numbers_.size());
}

void FamilyLaw::set(const Families& families) {
  clear();
  for (std::size_t i = 0; i < families.size(); ++i) {
    append(families, i, families.log_weight[i], 0, 1);
    table_.push_back(0);
    numbers_.push_back(1);
    first_.push_back(numbers_.size());
  }
}

// Where the search for quantiles starts: from mean and standard deviation of the families as they were before the
// observation, moved to N(mu, s^2), or to the median of a table.
void FamilyLaw::normalise(const LineBounds& bounds) {
  low_ = bounds.lower;
  high_ = bounds.upper;
  const double largest = *std::max_element(log_weight_.begin(), log_weight_.end());
  double mass = 0;
  weight_.resize(size());
  for (std::size_t i = 0; i < size(); ++i) mass += weight_[i] = std::exp(log_weight_[i] - largest);
  double mean = 0, second = 0, points = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    weight_[i] /= mass;
    if (weight_[i] < negligible_weight) weight_[i] = 0;
    if (!(sd_[i] > 0)) points += weight_[i];
    const FamilyShape shape{a_[i], c_[i], d_[i]};
    const double x = mean_[i] + sd_[i] * shape(mu_[i]), spread = sd_[i] * s_[i];
    mean += weight_[i] * x;
    second += weight_[i] * (x * x + spread * spread);
  }
  // Far out in the law points of no mass are no obstacle to a density: 1e-12 is that of rounding.
  points_ = points >= 1e-12;
  centre_ = mean;
  width_ = std::sqrt(std::max(0.0, second - mean * mean));
}

double FamilyLaw::below(std::size_t i, double z) const {
  const std::span<const double> all{numbers_.data() + first_[i], first_[i + 1] - first_[i]};
  if (table_[i] == 0) {
    const double zeta = (z - mu_[i]) / s_[i];
    if (std::abs(zeta) > 12) return zeta > 0 ? 1 : 0;
    const double gaussian = normal_below(zeta);
    return all.size() == 1 ? gaussian : gaussian - normal_density(zeta) * hermite_sum(all, 1, zeta);
  }
  const std::size_t n = all.size() / 3;
  const double *x = all.data(), *F = x + n, *f = F + n;
  if (z <= x[0]) return 0;
  if (z >= x[n - 1]) return 1;
  const std::size_t k = static_cast<std::size_t>(std::upper_bound(x, x + n, z) - x) - 1;
  const double h = x[k + 1] - x[k], t = (z - x[k]) / h, u = 1 - t;
  const double cubic =
      u * u * (1 + 2 * t) * F[k] + t * t * (3 - 2 * t) * F[k + 1] + h * t * u * (u * f[k] - t * f[k + 1]);
  return std::clamp(cubic, F[k], F[k + 1]);
}

double FamilyLaw::density_of_z(std::size_t i, double z) const {
  const std::span<const double> all{numbers_.data() + first_[i], first_[i + 1] - first_[i]};
  if (table_[i] == 0) {
    const double zeta = (z - mu_[i]) / s_[i];
    if (std::abs(zeta) > 12) return 0;
    return normal_density(zeta) * hermite_sum(all, 0, zeta) / s_[i];
  }
  const std::size_t n = all.size() / 3;
  const double *x = all.data(), *F = x + n, *f = F + n;
  if (z <= x[0] || z >= x[n - 1]) return 0;
  const std::size_t k = static_cast<std::size_t>(std::upper_bound(x, x + n, z) - x) - 1;
  const double h = x[k + 1] - x[k], t = (z - x[k]) / h, u = 1 - t;
  return std::max(0.0,
                  6 * t * u * (F[k + 1] - F[k]) / h + u * (1 - 3 * t) * f[k] + t * (3 * t - 2) * f[k + 1]);
}

double FamilyLaw::distribution(double x) const {
  if (x < low_) return 0;
  if (x >= high_) return 1;
  double sum = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!(weight_[i] > 0)) continue;
    if (sd_[i] > 0)
      sum += weight_[i] * below(i, FamilyShape{a_[i], c_[i], d_[i]}.inverse((x - mean_[i]) / sd_[i]));
    else
      sum += mean_[i] <= x ? weight_[i] : 0.0;
  }
  return sum;
}

double FamilyLaw::density(double x) const {
  if (x < low_ || x > high_) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!(weight_[i] > 0) || !(sd_[i] > 0)) continue;
    const FamilyShape shape{a_[i], c_[i], d_[i]};
    const double z = shape.inverse((x - mean_[i]) / sd_[i]);
    sum += weight_[i] * density_of_z(i, z) / (sd_[i] * shape.slope(z));
  }
  return std::max(0.0, sum);
}

// Newton's step where it stays inside the bracket, else bisection, to 1e-10 of the law's width.
double FamilyLaw::quantile(double level, double start) const {
  const double scale = width_ > 0 ? width_ : std::max(1e-12, 1e-12 * std::abs(centre_));
  double x = std::clamp(start, low_, high_), low = x, high = x, step = scale;
  for (int k = 0; k < 200 && low > low_ && distribution(low) >= level; ++k, step *= 2)
    high = low, low = std::max(low_, low - step);
  step = scale;
  for (int k = 0; k < 200 && high < high_ && distribution(high) < level; ++k, step *= 2)
    low = high, high = std::min(high_, high + step);
  const double resolution = 1e-10 * scale;
  x = low + (high - low) / 2;
  for (int k = 0; k < 200 && high - low > resolution; ++k) {
    const double excess = distribution(x) - level;
    (excess < 0 ? low : high) = x;
    const double slope = density(x), move = slope > 0 ? excess / slope : infinity;
    if (std::abs(move) < resolution) return std::clamp(x - move, low_, high_);
    x = x - move > low && x - move < high ? x - move : low + (high - low) / 2;
  }
  return low + (high - low) / 2;
}

void FamilyLaw::quantiles(std::span<const double> levels, std::span<double> out) const {
  double start = centre_;
  for (std::size_t q = 0; q < levels.size(); ++q) start = out[q] = quantile(levels[q], start);
}

void FamilyLaw::exchange(StateArchive& archive) {
  archive(log_weight_, mean_, sd_, a_, c_, d_, mu_, s_, first_, table_, numbers_);
  const std::size_t n = size();
  bool fits = first_.size() == n + 1 && table_.size() == n && log_weight_.size() == n && sd_.size() == n &&
              a_.size() == n && c_.size() == n && d_.size() == n && mu_.size() == n && s_.size() == n &&
              (first_.empty() || (first_.front() == 0 && first_.back() == numbers_.size()));
  for (std::size_t i = 0; fits && i < n; ++i)
    fits = first_[i + 1] > first_[i] && first_[i + 1] <= numbers_.size() && s_[i] > 0 &&
           (table_[i] == 0 || (first_[i + 1] - first_[i]) % 3 == 0);
  StateArchive::require(fits);
}

}  // namespace wienertree
