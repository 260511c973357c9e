#include "wienertree/filter/posterior.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace wienertree {
namespace {

double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

// E[(m + sqrt(v) Z)^k] by the recursion M_k = m M_{k-1} + (k-1) v M_{k-2}.
double gaussian_moment(double m, double v, int order) {
  double before = 1, now = m;
  if (order == 0) return 1;
  for (int k = 2; k <= order; ++k) {
    const double next = m * now + (k - 1) * v * before;
    before = now;
    now = next;
  }
  return now;
}

struct Atom {
  double x, weight;
};

// Quantiles of Dirac masses in linear time: a histogram locates the atoms around each level, and only those
// are sorted.
class AtomQuantiles {
 public:
  AtomQuantiles(std::span<const double> x, std::span<const double> weight) : x_(x), weight_(weight) {
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    low_ = *low;
    scale_ = *high > *low ? static_cast<double>(buckets) / (*high - *low) : 0.0;
    for (std::size_t n = 0; n < x.size(); ++n) mass_[bucket(x[n])] += weight[n];
  }

  double at(double level) {
    // The bucket where the cumulated weight passes the level, with its non-empty neighbours: the midpoints
    // that bracket the level belong to these.
    std::size_t b = 0;
    double before = 0;
    while (b + 1 < buckets && before + mass_[b] < level) before += mass_[b++];
    std::size_t first = b, last = b;
    while (first > 0 && (first == b || mass_[first] == 0)) before -= mass_[--first];
    while (last + 1 < buckets && (last == b || mass_[last] == 0)) ++last;
    atoms_.clear();
    for (std::size_t n = 0; n < x_.size(); ++n)
      if (const std::size_t at = bucket(x_[n]); at >= first && at <= last && weight_[n] > 0)
        atoms_.push_back({x_[n], weight_[n]});
    std::sort(atoms_.begin(), atoms_.end(), [](const Atom& a, const Atom& b_) { return a.x < b_.x; });
    if (atoms_.empty()) return x_[0];
    double previous_x = atoms_.front().x, previous_level = -1;
    for (const Atom& a : atoms_) {
      const double middle = before + a.weight / 2;
      if (middle >= level) {
        if (previous_level < 0) return a.x;
        return previous_x + (a.x - previous_x) * (level - previous_level) / (middle - previous_level);
      }
      previous_x = a.x;
      previous_level = middle;
      before += a.weight;
    }
    return previous_x;
  }

 private:
  static constexpr std::size_t buckets = 1024;
  std::size_t bucket(double x) const {
    return std::min(buckets - 1, static_cast<std::size_t>((x - low_) * scale_));
  }
  std::span<const double> x_, weight_;
  double low_ = 0, scale_ = 0;
  std::array<double, buckets> mass_{};
  std::vector<Atom> atoms_;
};

double gaussian_quantile(const Posterior& posterior, std::size_t i, double level) {
  double low = INFINITY, high = -INFINITY;
  for (std::size_t n = 0; n < posterior.size(); ++n) {
    const double sd = std::sqrt(posterior.variance_of(i, n)), m = posterior.points(i, n);
    low = std::min(low, m - 40 * sd);
    high = std::max(high, m + 40 * sd);
  }
  // Bisection to the last bit: at most about 60 halvings for the 53 bits and the width of the bracket.
  for (int k = 0; k < 200; ++k) {
    const double middle = low + (high - low) / 2;
    if (!(low < middle && middle < high)) break;
    (distribution(posterior, i, middle) < level ? low : high) = middle;
  }
  return high;
}

}  // namespace

double Posterior::variance_of(std::size_t i, std::size_t n) const {
  if (dirac()) return 0;
  return covariance(i * points.components() + i, covariance.nodes() == 1 ? 0 : n);
}

double mean(const Posterior& posterior, std::size_t i) {
  const double* x = posterior.points.component(i).data();
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n) sum += posterior.weight[n] * x[n];
  return sum;
}

double covariance(const Posterior& posterior, std::size_t i, std::size_t j) {
  const double mi = mean(posterior, i), mj = i == j ? mi : mean(posterior, j);
  const double* x = posterior.points.component(i).data();
  const double* y = posterior.points.component(j).data();
  const std::size_t d = posterior.points.components();
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n) sum += posterior.weight[n] * (x[n] - mi) * (y[n] - mj);
  if (!posterior.dirac())
    for (std::size_t n = 0; n < posterior.size(); ++n)
      sum += posterior.weight[n] * posterior.covariance(i * d + j, posterior.covariance.nodes() == 1 ? 0 : n);
  return sum;
}

double raw_moment(const Posterior& posterior, std::size_t i, int order) {
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n)
    sum += posterior.weight[n] * gaussian_moment(posterior.points(i, n), posterior.variance_of(i, n), order);
  return sum;
}

double effective_sample_size(const Posterior& posterior) {
  double sum = 0;
  for (const double w : posterior.weight) sum += w * w;
  return 1 / sum;
}

double distribution(const Posterior& posterior, std::size_t i, double x) {
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n) {
    const double v = posterior.variance_of(i, n), m = posterior.points(i, n);
    sum += posterior.weight[n] * (v > 0 ? normal_distribution((x - m) / std::sqrt(v)) : (m <= x ? 1.0 : 0.0));
  }
  return sum;
}

double density(const Posterior& posterior, std::size_t i, double x) {
  assert(!posterior.dirac());
  double sum = 0;
  for (std::size_t n = 0; n < posterior.size(); ++n) {
    const double v = posterior.variance_of(i, n), z = x - posterior.points(i, n);
    sum += posterior.weight[n] * std::exp(-z * z / (2 * v)) / std::sqrt(2 * std::numbers::pi * v);
  }
  return sum;
}

void quantiles(const Posterior& posterior, std::size_t i, std::span<const double> levels,
               std::span<double> out) {
  if (!posterior.dirac()) {
    for (std::size_t q = 0; q < levels.size(); ++q) out[q] = gaussian_quantile(posterior, i, levels[q]);
    return;
  }
  AtomQuantiles atoms(posterior.points.component(i), posterior.weight);
  for (std::size_t q = 0; q < levels.size(); ++q) out[q] = atoms.at(levels[q]);
}

void summarise(const Posterior& posterior, std::size_t components, int highest_moment,
               PosteriorSummary& out) {
  constexpr std::array levels = {0.05, 0.5, 0.95};
  out.time = posterior.time;
  out.log_evidence = posterior.log_evidence;
  out.ess = effective_sample_size(posterior);
  out.nodes = posterior.kept;
  for (auto* v : {&out.mean, &out.sd, &out.q05, &out.q50, &out.q95}) v->resize(components);
  out.moments.resize(highest_moment >= 2 ? components : 0);
  for (std::size_t i = 0; i < components; ++i) {
    out.mean[i] = mean(posterior, i);
    out.sd[i] = std::sqrt(std::max(0.0, covariance(posterior, i, i)));
    std::array<double, 3> q{};
    quantiles(posterior, i, levels, q);
    out.q05[i] = q[0];
    out.q50[i] = q[1];
    out.q95[i] = q[2];
    if (highest_moment < 2) continue;
    out.moments[i].clear();
    for (int k = 2; k <= highest_moment; ++k) out.moments[i].push_back(raw_moment(posterior, i, k));
  }
}

}  // namespace wienertree
