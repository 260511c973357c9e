#pragma once
/// The Euler particle filter (bootstrap filter; Gordon, Salmond, Smith 1993): N particles moved by
/// Euler-Maruyama of the Ito form,
///     x_{j+1} = x_j + V~_0(x_j) s + sum_r V_r(x_j) sqrt(s) xi^r,   xi^r independent N(0,1),
/// weighted by the same functionals as the KLV filter, and resampled by any counting `Thinning`, at every
/// step or when the effective sample size falls below a fraction of N.
#include "wienertree/filter/filter.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// Weights are unnormalised throughout, so that the evidence is right for any resampling schedule, none
/// included. Posteriors are those before resampling.
class EulerFilter final : public Filter {
 public:
  EulerFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "euler"; }

 private:
  void exchange_state(StateArchive& archive) override;
  /// What a thread needs for a block.
  struct Scratch {
    Batch noise, sensor, derivative, end_sensor;
    std::vector<double> term;
  };
  void resample_if_due(const ObservationWindow& window);
  void step(const ObservationWindow& window, std::size_t first, std::size_t count, Scratch& scratch);
  void move(const ObservationWindow& window, std::size_t first, ConstBatchView x, BatchView next,
            Scratch& scratch) const;
  void normalise();

  Model model_;
  FilterOptions options_;
  std::unique_ptr<Functional> functional_;
  std::unique_ptr<Thinning> thinning_;
  ThreadPool pool_;
  std::vector<Scratch> scratch_;
  Batch x_, next_;
  std::vector<double> log_weight_;
  Selection selection_;
  NormalisedWeights normalised_;  ///< of log_weight_, unless stale
  bool stale_ = true;
  double time_ = 0;
  bool weighed_ = false;  ///< whether an observation came since the last resampling
  std::size_t kept_;
  Posterior posterior_;
};

}  // namespace wienertree
