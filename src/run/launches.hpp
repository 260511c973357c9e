#pragma once
/// Independent launches of one filter, side by side, and what they say together.
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "wienertree/filter/filter.hpp"
#include "wienertree/run/recommended_options.hpp"

namespace wienertree {

/// What M launches say of one time.
struct LaunchesSummary {
  PosteriorSummary mean;  ///< averages over the launches; the evidence itself is averaged, not its logarithm
  double nodes = 0;       ///< average
  std::vector<double>
      mean_sd;  ///< per component: standard deviation over the launches of the posterior mean; 0 for M = 1
  double log_evidence_sd = 0;
  /// Standard error of the log of the averaged evidence: sd(Z)/(mean(Z) sqrt(M)), from the launches' Z; 0 for M = 1.
  double log_evidence_error = 0;
  std::optional<LikelihoodRatio> ratio;  ///< of a filter that keeps it: averages of L and of its variance
};

void exchange(StateArchive& archive, LaunchesSummary& summary);

/// log of the mean of exp(l). @pre not empty
double log_average(std::span<const double> logarithms);

class Launches {
 public:
  /// @throws InputError as make_filter
  Launches(const Model& model, const FilterSetup& setup);
  void advance(const ObservationWindow& window);
  std::size_t size() const { return filters_.size(); }
  /// The law of the first launch.
  const Posterior& posterior() { return filters_.front()->posterior(); }
  void summarise(double time, int highest_moment, LaunchesSummary& out);
  void exchange(StateArchive& archive);
  /// Work of all launches together.
  FilterStatistics statistics() const;
  /// Of the launches, one of each kind.
  std::vector<FilterWarning> warnings() const;

 private:
  std::optional<LikelihoodRatio> average_ratio();

  std::size_t components_;
  std::vector<std::unique_ptr<Filter>> filters_;
  std::vector<PosteriorSummary> summaries_;
};

}  // namespace wienertree
