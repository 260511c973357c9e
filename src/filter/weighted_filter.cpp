#include "wienertree/filter/weighted_filter.hpp"

#include <cmath>

namespace wienertree {
namespace {

FilterOptions never_resampled(const Model& model, FilterOptions options) {
  if (model.observation != ObservationKind::discrete)
    throw InputError("the weighted particle filter compares discrete observations with noise",
                     "model " + model.name);
  model.density->log_noise_density(std::vector<double>(model.density->observation_dimension(), 0.0));
  options.thinning.method = ThinningMethod::none;
  return options;
}

}  // namespace

WeightedFilter::WeightedFilter(const Model& model, const FilterOptions& options)
    : density_(model.density), particles_(model, never_resampled(model, options)) {}

void WeightedFilter::advance(const ObservationWindow& window) {
  particles_.advance(window);
  if (!window.observation.empty()) log_noise_ += density_->log_noise_density(window.observation);
  statistics_ = particles_.statistics();
}

void WeightedFilter::exchange_state(StateArchive& archive) {
  particles_.exchange(archive);
  archive(log_noise_);
}

// With mean m and effective size S, (1/N) sum L^2 = N m^2 / S.
std::optional<LikelihoodRatio> WeightedFilter::likelihood_ratio() {
  const Posterior& p = particles_.posterior();
  LikelihoodRatio ratio;
  ratio.log_mean = p.log_evidence - log_noise_;
  ratio.effective_size = effective_sample_size(p);
  const double excess = static_cast<double>(p.size()) / ratio.effective_size - 1;
  // Equal weights leave an excess of rounding.
  ratio.log_variance = excess > 1e-12 ? 2 * ratio.log_mean + std::log(excess) : -INFINITY;
  return ratio;
}

}  // namespace wienertree
