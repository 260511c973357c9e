#pragma once
/// Runs a filter over its observations, next to what it is compared with.
#include <functional>
#include <optional>
#include <vector>

#include "density_plot.hpp"
#include "launches.hpp"
#include "window_source.hpp"

namespace wienertree::app {

struct FilterRequest {
  int highest_moment = 0;            ///< of the table; 0 for none beyond mean and sd
  std::optional<double> density_at;  ///< time at which the law itself is kept
  bool progress = true;
  std::function<void(const LaunchesSummary&)> observe;  ///< called with each row as it comes; may be empty
};

struct FilterRun {
  std::vector<LaunchesSummary> rows;    ///< the start, then the end of each window
  std::vector<PosteriorSummary> exact;  ///< of the exact filter at the same times; empty where there is none
  std::vector<DensityPanel> density;    ///< at the end of the first window not before `density_at`
  double density_time = 0;
  FilterStatistics statistics;
};

/// @throws InputError if the observations end before `density_at` or a row cannot be read; RunError as
/// Filter::advance
FilterRun run_filter(const Model& model, const FilterSetup& setup, WindowSource& windows,
                     const FilterRequest& request);

}  // namespace wienertree::app
