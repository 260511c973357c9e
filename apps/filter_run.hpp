#pragma once
/// Runs a filter over its observations, next to what it is compared with.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "density_plot.hpp"
#include "saved_run.hpp"
#include "wienertree/run/launches.hpp"
#include "wienertree/run/window_source.hpp"

namespace wienertree::app {

struct FilterRequest {
  int highest_moment = 0;            ///< of the table; 0 for none beyond mean and sd
  std::optional<double> density_at;  ///< time at which the law itself is kept
  bool progress = true;
  bool keep_rows = true;        ///< for a table or a picture afterwards; else memory does not grow with steps
  bool keep_exact_rows = true;  ///< for a picture
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
  FilterStatistics statistics;
};

/// @throws InputError if the observations end before `density_at` or a row cannot be read; RunError as
/// Filter::advance; Interrupted if a noted interruption ended it, its checkpoint being written
FilterRun run_filter(const Model& model, const FilterSetup& setup, WindowSource& windows,
                     const FilterRequest& request, SavedRun& saved);

}  // namespace wienertree::app
