#pragma once
/// The weighted particle filter (Kouritzin 2017, Residual and stratified branching particle filters, Comput.
/// Statist. Data Anal. 111, 145-165; Kouritzin, Zeng 2005, Bayesian model selection via filtering, Stoch.
/// Models 21): particles are moved as those of the Euler filter and never resampled, each with the likelihood
/// ratio of the model against noise alone,
///
///     L_n = prod_{j <= n} g(y_j - h(X)) / g(y_j),        sigma_n(f) = (1/N) sum_k L^k_n f(X^k_n),
///
/// with g the density of the noise. sigma_n(1) is the Bayes factor of the model against noise, and the
/// quotient of two models' sigma_n(1) their Bayes factor. If y were noise, sigma_n(1) would have the variance
/// gamma_n/N with
///
///     gamma_n = E prod lambda(X_j, X_j) - E prod lambda(X_j, X'_j),
///     lambda(x, xi) = int g(y-h(x)) g(y-h(xi)) / g(y) dy,
///
/// X' an independent copy of X (noise_overlap.hpp): infinite for some models after a few observations.
#include "wienertree/filter/euler_filter.hpp"

namespace wienertree {

class WeightedFilter final : public Filter {
 public:
  /// @throws InputError unless observations are discrete, h(x) + noise
  WeightedFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override { return particles_.posterior(); }
  std::string_view name() const override { return "weighted"; }
  std::optional<LikelihoodRatio> likelihood_ratio() override;

 private:
  void exchange_state(StateArchive& archive) override;
  std::shared_ptr<const ObservationDensity> density_;
  EulerFilter particles_;
  double log_noise_ = 0;  ///< log prod g(y_j)
};

}  // namespace wienertree
