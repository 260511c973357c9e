#pragma once
/// What `filter` tells besides its table: its JSON report, its summary for people.
#include <string>

#include "filter_run.hpp"
#include "table.hpp"

namespace wienertree::app {

/// What was run on what.
struct FilterContext {
  const Model& model;
  const FilterSetup& setup;
  const WindowSource& windows;
  std::string observations;  ///< as given
  int highest_moment;
  const ControlOptions& control;
};

/// Version, model with its parameters, every option in force (but --threads, which changes no result), and
/// the final posterior.
Json filter_report(const FilterContext& context, const FilterRun& run);

/// "wienertree: 12 of 300 nodes could not be moved and were dropped\n"
std::string dropped_line(const FilterRun& run);

/// "warning: the weights collapsed at t = 3: ..\n". @pre run.collapsed_at
std::string collapse_warning(const FilterRun& run);

/// The final posterior as an aligned table, beside the exact one where there is one; log evidence, work,
/// time.
std::string filter_summary(const FilterContext& context, const FilterRun& run, double seconds);

}  // namespace wienertree::app
