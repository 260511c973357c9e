#pragma once
/// What `filter` tells: its table, its JSON report, its summary for people.
#include <string>

#include "filter_run.hpp"
#include "table.hpp"

namespace wienertree::app {

/// t, mean_<state>.., sd_<state>.., q05_, q50_, q95_<state>.., log_evidence, nodes, ess, then m2_<state>..
/// mK_<state> if asked for, then, for the weighted filter, log_bayes_factor and log_variance of the
/// likelihood ratio against noise, then, for several launches, mc_sd_<state>.. and mc_sd_log_evidence:
/// standard deviations over the launches.
std::vector<std::string> filter_columns(const Model& model, const FilterSetup& setup, int highest_moment);
std::vector<double> filter_row(const LaunchesSummary& summary, bool several_launches);

/// What was run on what.
struct FilterContext {
  const Model& model;
  const FilterSetup& setup;
  const WindowSource& windows;
  std::string observations;  ///< as given
  int highest_moment;
};

/// Version, model with its parameters, every option in force (but --threads, which changes no result), and
/// the final posterior.
Json filter_report(const FilterContext& context, const FilterRun& run);

/// The final posterior as an aligned table, beside the exact one where there is one; log evidence, work,
/// time.
std::string filter_summary(const FilterContext& context, const FilterRun& run, double seconds);

}  // namespace wienertree::app
