#pragma once
/// The Kusuoka-Lyons-Victoir filter (Crisan, Ghazali 2007; Crisan, Ortiz-Latorre 2013): a tree of cubature
/// paths, weighted by the observation and thinned as it grows. Without thinning it is the full tree,
///     rho^n(phi) = sum_{|b| = n} lambda_b w_0(x_{b[0]}) .. w_{n-1}(x_{b[n-1]}) phi(x_b).
#include "wienertree/filter/filter.hpp"
#include "wienertree/tree/growth.hpp"

namespace wienertree {

/// Posteriors are those of the children before they are thinned: thinning serves the next step only, and its
/// error is not added where it need not be. While the children number at most N they are all kept, with their
/// exact weights.
class KlvFilter final : public Filter {
 public:
  KlvFilter(const Model& model, const FilterOptions& options);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override;
  const Generation* generation() const override { return &survivors_; }

 private:
  void exchange_state(StateArchive& archive) override;
  using LogWeights = decltype(Generation::log_weight);
  class Weigher;
  /// What a thread needs for one block of parents and its children.
  struct Scratch {
    Batch sensor, derivative, end_sensor;
    std::vector<double> term;
    double best_term = 0;  ///< the largest log-density of the observation that the thread has seen
  };

  void weigh_start(const ObservationWindow& window);
  void grow(const ObservationWindow& window);
  void thin(const ObservationWindow& window);
  void let_likelihoods_decide_if_due();
  void handle_failures(const ObservationWindow& window);
  bool carries_likelihood() const;
  LogWeights& likelihood_of(Generation& generation) const;

  Model model_;
  FilterOptions options_;
  std::unique_ptr<Functional> functional_;
  std::unique_ptr<Thinning> thinning_;
  TreeGrower grower_;
  Generation survivors_, children_;
  const Generation*
      current_;  ///< what the posterior is made of: children_, or survivors_ where they are the same
  Selection selection_;
  std::vector<Scratch> scratch_;  ///< one a thread
  std::vector<double> start_term_;
  std::vector<NodeFailure> failures_;
  FlowStatistics flow_before_;  ///< work of the filter whose state was read
  double time_ = 0;
  NormalisedWeights normalised_;
  bool stale_ = true;
  Posterior posterior_;
};

}  // namespace wienertree
