#pragma once
/// The table of `filter`.
#include <span>
#include <string>
#include <vector>

#include "wienertree/run/launches.hpp"

namespace wienertree::app {

/// The states that are told of.
std::span<const std::string> states_of(const Model& model);

/// t, mean_<state>.., sd_<state>.., q05_, q50_, q95_<state>.., log_evidence, nodes, ess, then m2_<state>..
/// mK_<state> if asked for, then, for the weighted filter, log_bayes_factor and log_variance of the
/// likelihood ratio against noise, then, for several launches, mc_sd_<state>.. and mc_sd_log_evidence:
/// standard deviations over the launches.
std::vector<std::string> filter_columns(const Model& model, const FilterSetup& setup, int highest_moment);
std::vector<double> filter_row(const LaunchesSummary& summary, bool several_launches);

}  // namespace wienertree::app
