// The filter of components: an observation taken in, and what is doubtful about it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/component_filter.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/places.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {

void ComponentFilter::weigh(const ObservationWindow& window, std::span<const double> y, double clock) {
  if (y.empty() || all_missing(y)) return;
  check_reach(window, y, clock);
  const double spread = take_in(y, clock, options_.nodes);
  if (spread > 0.15)
    warn(WarningKind::unfit_tilt, window.end,
         fmt::format("more components than {} were needed for the likelihood, whose logarithm departs from a "
                     "quadratic "
                     "by {:.2g} in those there are",
                     8 * options_.nodes, spread));
  const LargestLogWeight largest = largest_log_weight(components_.log_weight);
  if (!largest.all_valid || !(largest.value > -std::numeric_limits<double>::infinity()))
    throw RunError("the observation has no likelihood", place_and_observation(window));
  const MixtureMoments law = moments(components_);
  if (pilot_evidence_ && std::abs(*pilot_evidence_ - law.log_mass) > 0.5)
    warn(WarningKind::unfit_tilt, window.end,
         fmt::format("the likelihood is far from Gaussian: filters with and without a tilt towards it differ "
                     "by {:.2g} "
                     "in log evidence",
                     std::abs(*pilot_evidence_ - law.log_mass)));
  if (nonlinear_ && components_.size() > 1 && law.effective_size < 5)
    warn(WarningKind::few_atoms, window.end,
         fmt::format("{:.1f} of {} components carry the law after an observation", law.effective_size,
                     components_.size()));
}

// Divides what the likelihood calls for, and conditions.
double ComponentFilter::take_in(std::span<const double> y, double clock, std::size_t nodes) {
  const ComponentUpdate::Limits limits{0.25 * options_.substep_tolerance, (d_ == 2 ? 24 : 8) * nodes};
  const std::uint64_t before = update_->conditioned();
  const double left = update_->condition(y, clock, limits, components_, &threads_);
  statistics_.conditioned += update_->conditioned() - before;
  if (components_.size() > 8 * nodes) merge_.merge(components_, 8 * nodes);
  return left;
}

// (y - predicted)^2/S of each component of y with Gaussian noise.
void ComponentFilter::check_reach(const ObservationWindow& window, std::span<const double> y, double clock) {
  const std::vector<double>& R = update_->expansion().gaussian_variances();
  if (R.empty()) return;
  const MixtureMoments law = moments(components_);
  const GaussianCubature& rule = equations_.rule();
  const auto points = static_cast<std::size_t>(rule.weights.size());
  const Eigen::MatrixXd L = semidefinite_root(law.covariance);
  Batch x(model_.state_dimension(), points), h(y.size(), points);
  for (std::size_t q = 0; q < points; ++q)
    put_vector(Eigen::VectorXd(law.mean + L * rule.points.col(static_cast<Eigen::Index>(q))), x, q);
  equations_.complete(x, clock);
  model_.fields->sensor(x, h);
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (std::isnan(y[i])) continue;
    double mean = 0, variance = R[i];
    for (std::size_t q = 0; q < points; ++q) mean += rule.weights(static_cast<Eigen::Index>(q)) * h(i, q);
    for (std::size_t q = 0; q < points; ++q)
      variance += rule.weights(static_cast<Eigen::Index>(q)) * (h(i, q) - mean) * (h(i, q) - mean);
    const double distance = (y[i] - mean) * (y[i] - mean) / variance;
    if (distance > 50)
      warn(WarningKind::out_of_reach, window.end,
           fmt::format("y{} = {:g} lies {:.1f} standard deviations from its prediction {:.4g}", i + 1, y[i],
                       std::sqrt(distance), mean));
  }
}

void ComponentFilter::check_bounds(double time) {
  for (std::size_t i = 0; i < d_; ++i) {
    const StateBound& b = model_.bounds[i];
    if (!b.bounded()) continue;
    const double largest = largest_log_weight(components_.log_weight).value;
    double mass = 0, outside = 0;
    for (std::size_t n = 0; n < components_.size(); ++n) {
      const double w = std::exp(components_.log_weight[n] - largest), x = components_.mean(i, n);
      const double sd = std::sqrt(std::max(0.0, components_.covariance(i * d_ + i, n)));
      const auto beyond = [&](double distance) {
        return sd > 0 ? 0.5 * std::erfc(distance / (sd * std::sqrt(2.0))) : distance < 0 ? 1.0 : 0.0;
      };
      mass += w;
      outside += w * (beyond(x - b.lower) + beyond(b.upper - x));
    }
    if (outside > 1e-3 * mass)
      warn(WarningKind::at_bound, time,
           fmt::format("{:.2g} of the law of {} lies beyond its bounds, where fields are taken at the bound",
                       outside / mass, model_.state_names[i]));
  }
}

void ComponentFilter::warn(WarningKind kind, double time, std::string text) {
  for (const FilterWarning& w : warnings_)
    if (w.kind == kind) return;
  warnings_.push_back({kind, time, std::move(text)});
}

}  // namespace wienertree
