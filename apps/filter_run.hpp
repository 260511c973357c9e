#pragma once
/// Runs a filter over its observations, next to what it is compared with.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "density_plot.hpp"
#include "saved_run.hpp"
#include "wienertree/run/controlled_filter.hpp"
#include "wienertree/run/launches.hpp"
#include "wienertree/run/window_source.hpp"

namespace wienertree::app {

struct FilterRequest {
  std::optional<double> density_at;  ///< time at which the law itself is kept
  bool progress = true;
  bool keep_rows = true;        ///< for a table or a picture afterwards; else memory does not grow with steps
  bool keep_exact_rows = true;  ///< for a picture
  bool errors = false;          ///< estimates of error in the rows
  std::function<void(const std::vector<double>&)>
      observe;  ///< called with each row as it comes; may be empty
};

struct FilterRun {
  std::vector<std::vector<double>> rows;        ///< of the table: the start, then the end of each window
  std::vector<std::vector<double>> exact_rows;  ///< of the exact filter, in the same columns
  LaunchesSummary last;
  std::optional<PosteriorSummary> exact;  ///< the exact filter's last, where there is one
  std::optional<double> collapsed_at;     ///< first time when a likelihood ratio rested on too few particles
  std::vector<DensityPanel> density;      ///< at the end of the first window not before `density_at`
  double density_time = 0;
  FilterStatistics statistics;  ///< of the answer
  FilterSetup setup;            ///< with the resolution of the answer
  double start = 0;
  AnswerError error;  ///< the largest over the rows
  bool error_known = false;
  std::vector<std::string> warnings;  ///< a sentence each
};

/// A record: the resolution is chosen and the error estimated by runs of other resolutions (ControlledFilter).
/// @throws InputError if `density_at` is outside the observations; RunError as Filter::advance; Interrupted if a noted
/// interruption ended it, its checkpoint being written
FilterRun filter_record(const Model& model, const FilterSetup& setup, const ControlOptions& control,
                        ObservationRows rows, const FilterRequest& request, SavedRun& saved);

/// A stream, of which every row ends a step: a filter of half the nodes goes beside the one that answers, and one of
/// another degree; what they differ by is the estimate of error so far.
/// @throws InputError also for a row that cannot be read, or if the stream ends before `density_at`
FilterRun filter_stream(const Model& model, const FilterSetup& setup, const ControlOptions& control,
                        WindowSource& windows, const FilterRequest& request, SavedRun& saved);

}  // namespace wienertree::app
