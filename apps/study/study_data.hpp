#pragma once
/// What the cells of a study share: observation paths and the truth on them, made when first asked for, by
/// any thread.
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "study_cells.hpp"
#include "wienertree/filter/observations.hpp"

namespace wienertree::app {

/// A number that a filter is asked for: mean_<state>, sd_<state>, m<k>_<state>, wasserstein_<state>,
/// log_evidence, log_bayes_factor, variance (of the likelihood ratio).
struct Quantity {
  enum class Kind { mean, sd, moment, wasserstein, log_evidence, log_bayes_factor, variance };
  Kind kind = Kind::mean;
  std::size_t component = 0;
  int order = 0;  ///< of a moment
};
/// @throws InputError for an unknown quantity or state
Quantity parse_quantity(const std::string& name, const Model& model);

/// A posterior that outlives its filter.
class KeptPosterior {
 public:
  explicit KeptPosterior(const Posterior& posterior);
  Posterior view() const;

 private:
  Posterior scalars_;
  Batch points_, covariance_;
  std::vector<double> weight_;
};

/// The truth for one problem on one path.
struct StudyTruth {
  std::vector<double> values;  ///< one a quantity; NaN without a reference, 0 for a distance
  std::optional<KeptPosterior> posterior;
};

/// Runs the filter over the windows that end no later than `until`.
void run_until(Filter& filter, const ObservationWindows& windows, std::optional<double> until);
/// @param truth may be null unless the quantity is a distance. NaN where the filter does not know the
/// quantity
double quantity_of(const Quantity& quantity, Filter& filter, const KeptPosterior* truth);

/// Where the record lies that a study filters, if it is not simulated.
std::string observation_file(const Study& study);

class StudyData {
 public:
  /// @throws InputError for a reference that does not apply, a quantity that is unknown, a file that cannot
  /// be read
  StudyData(const Study& study, const std::vector<StudyCell>& cells, ModelShelf& models);
  ~StudyData();
  std::size_t paths() const { return paths_; }
  const std::vector<Quantity>& quantities(const StudyCell& cell) const;
  /// What the runs of a cell are compared with; null where it is no run, no value where it is one.
  struct Reference {
    const FilterCell* filter = nullptr;
    const WeakCell* weak = nullptr;
    std::optional<double> value;
  };
  Reference reference(const StudyCell& cell) const;
  /// May be called by several threads. @throws InputError, RunError as simulate and filters
  const ObservationPath& observations(const StudyCell& cell, std::size_t path);
  const StudyTruth& truth(const StudyCell& cell, std::size_t path);
  ObservationWindows windows(const FilterCell& cell, const ObservationPath& path) const;

 private:
  void require_inside_record(const StudyCell& cell, double until);
  struct Path;
  struct Truth;
  struct Problem;
  StudyTruth filter_truth(const StudyCell& cell, std::size_t path);
  StudyTruth weak_truth(const StudyCell& cell);

  const Study& study_;
  std::size_t paths_ = 1;
  std::map<std::string, std::shared_ptr<const Model>> simulated_;      ///< by key of observations
  std::map<std::string, std::vector<std::unique_ptr<Path>>> records_;  ///< by key of observations
  std::map<std::string, std::unique_ptr<Problem>> problems_;           ///< by key of the truth
};

}  // namespace wienertree::app
