#include "wienertree/filter/component_update.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/component_merge.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

constexpr int most_rounds = 12;
constexpr double spacing = 1.5, reach = 5;  // of the parts, in kappa and in standard deviations
constexpr double negligible = 1e-4;         // worth of what is left undivided, altogether
constexpr double most_relief = 8;           // of the spread that is allowed, for narrow components
constexpr double lost = 1e-14;              // of the mass

// Points of the lattice on each side of 0.
int lattice_reach(double kappa) {
  return static_cast<int>(std::ceil(reach * std::sqrt(1 - kappa * kappa) / (spacing * kappa)));
}

void append(const GaussianComponents& from, std::size_t n, GaussianComponents& to, std::size_t at) {
  to.log_weight[at] = from.log_weight[n];
  for (std::size_t i = 0; i < from.mean.components(); ++i) to.mean(i, at) = from.mean(i, n);
  for (std::size_t i = 0; i < from.covariance.components(); ++i) to.covariance(i, at) = from.covariance(i, n);
}

}  // namespace

// What may be wrong with a component: its share of the mass times the square of the spread, at most 1. Those whose
// modes may hide have the share that their own points guess.
void ComponentUpdate::choose(const GaussianComponents& c, double log_mass, const Limits& limits) {
  // Where nothing has a likelihood yet there is no law to compare with.
  const bool known = std::isfinite(log_mass);
  GaussianComponents all;
  if (known) {
    all.reshape(c.states(), accepted_.size() + c.size());
    for (std::size_t n = 0; n < accepted_.size(); ++n) append(accepted_, n, all, n);
    for (std::size_t n = 0; n < c.size(); ++n) append(c, n, all, accepted_.size() + n);
    ComponentMerge::drop_negligible(all, lost);
  }
  const Eigen::MatrixXd S = known ? moments(all).covariance
                                  : Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(c.states()),
                                                          static_cast<Eigen::Index>(c.states()));
  const Whitening<Eigen::Dynamic> law{SmallSquare<Eigen::Dynamic>(S)};
  const ComponentConditioning::Reading& reading = conditioning_.reading();
  divisions_.clear();
  const double least = negligible / static_cast<double>(std::max<std::size_t>(c.size(), 100));
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double spread = reading.departure[n];
    const bool hides = reading.hides[n] != 0;
    double share = std::exp(c.log_weight[n] - log_mass);
    if (!std::isfinite(share)) share = 0;
    if (hides) share = std::max(share, std::min(1.0, std::exp(reading.guess[n] - log_mass)));
    const double worth = share * (hides ? 1.0 : std::min(1.0, spread * spread));
    const double variance =  // along the axis, after the observation, over that of the law
        known ? reading.narrowing[n] *
                    (law.whitening * vector_of<Eigen::Dynamic>(reading.axis, c.states(), n)).squaredNorm()
              : 1.0;
    const double allowed = limits.spread * std::clamp(1 / variance, 1.0, most_relief);
    if (!(worth > least) || !(hides || spread > allowed)) continue;
    const double part = hides ? 0.25 : std::clamp(allowed / spread, 1.0 / 16, 0.5);
    const double kappa = std::sqrt(std::max(1.0 / 400, part * reading.narrowing[n]));
    divisions_.push_back({n, kappa, worth, static_cast<std::size_t>(2 * lattice_reach(kappa) + 1)});
  }
  // What is worth most, as far as there is room.
  std::ranges::stable_sort(divisions_, std::ranges::greater{}, &Division::worth);
  std::size_t parts = 0, kept = 0;
  while (kept < divisions_.size() && (kept == 0 || parts + divisions_[kept].parts <= limits.components))
    parts += divisions_[kept++].parts;
  divisions_.resize(kept);
  std::ranges::sort(divisions_, std::ranges::less{}, &Division::component);
}

void ComponentUpdate::divide(const GaussianComponents& prior) {
  const std::size_t d = prior.states();
  const Batch& axis = conditioning_.reading().axis;
  std::size_t total = 0;
  for (const Division& division : divisions_) total += division.parts;
  parts_.reshape(d, total);
  std::size_t at = 0;
  for (const Division& division : divisions_) {
    const std::size_t n = division.component;
    const double kappa = division.kappa, residual = std::sqrt(1 - kappa * kappa);
    const int most = lattice_reach(kappa);
    double sum = 0, second = 0;
    const double step = spacing * kappa / residual;  // in standard deviations of what is given to the means
    for (int j = -most; j <= most; ++j) {
      const double u = step * j, w = std::exp(-u * u / 2);
      sum += w;
      second += w * u * u;
    }
    // What is cut off at 5 standard deviations is given back by the scale, so that the variance is kept.
    const double scale = residual / std::sqrt(second / sum);
    for (int j = -most; j <= most; ++j, ++at) {
      const double u = step * j;
      parts_.log_weight[at] = prior.log_weight[n] - u * u / 2 - std::log(sum);
      for (std::size_t i = 0; i < d; ++i) parts_.mean(i, at) = prior.mean(i, n) + scale * u * axis(i, n);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t k = 0; k < d; ++k)
          parts_.covariance(i * d + k, at) =
              prior.covariance(i * d + k, n) - residual * residual * axis(i, n) * axis(k, n);
    }
  }
}

double ComponentUpdate::condition(std::span<const double> y, double clock, const Limits& limits,
                                  GaussianComponents& components, ThreadPool* threads) {
  prior_ = components;
  conditioning_.condition(y, clock, components, threads);
  conditioned_ += components.size();
  if (expansion().linear_gaussian()) return 0;
  const std::size_t d = components.states();
  accepted_.reshape(d, 0);
  spread_.clear();
  GaussianComponents merged;
  for (int round = 0;; ++round) {
    double largest = largest_log_weight(components.log_weight).value;
    if (accepted_.size() > 0) largest = std::max(largest, largest_log_weight(accepted_.log_weight).value);
    double mass = 0;
    for (const GaussianComponents* c : {&components, &accepted_})
      for (const double w : c->log_weight)
        if (w > -INFINITY) mass += std::exp(w - largest);
    const double log_mass = largest + std::log(mass);
    divisions_.clear();
    if (round < most_rounds) choose(components, log_mass, limits);
    divided_.assign(components.size(), 0);
    for (const Division& division : divisions_) divided_[division.component] = 1;
    const auto stays = [&](std::size_t n) {
      return divided_[n] == 0 && !(components.log_weight[n] < log_mass + std::log(lost));
    };
    std::size_t kept = 0;
    for (std::size_t n = 0; n < components.size(); ++n) kept += stays(n) ? 1 : 0;
    merged.reshape(d, accepted_.size() + kept);
    std::size_t at = 0;
    for (std::size_t n = 0; n < accepted_.size(); ++n) append(accepted_, n, merged, at++);
    for (std::size_t n = 0; n < components.size(); ++n) {
      if (!stays(n)) continue;
      append(components, n, merged, at++);
      spread_.push_back(conditioning_.reading().departure[n]);
    }
    accepted_.swap(merged);
    if (divisions_.empty()) break;
    divide(prior_);
    prior_.swap(parts_);
    components = prior_;
    conditioning_.condition(y, clock, components, threads);
    conditioned_ += components.size();
  }
  components.swap(accepted_);
  const double left = root_mean_square(components, spread_);
  return left > 2 * most_relief * limits.spread ? left : 0;
}

}  // namespace wienertree
