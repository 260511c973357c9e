#pragma once
/// The table of `filter`.
#include <span>
#include <string>
#include <vector>

#include "wienertree/run/accuracy.hpp"
#include "wienertree/run/launches.hpp"

namespace wienertree::app {

/// The states that are told of.
std::span<const std::string> states_of(const Model& model);

/// t, mean_<state>.., sd_<state>.., q05_, q50_, q95_<state>.., log_evidence, nodes, ess, then m2_<state>..
/// mK_<state> if asked for, then, for the weighted filter, log_bayes_factor and log_variance of the
/// likelihood ratio against noise, then, for several launches, mc_sd_<state>.. and mc_sd_log_evidence:
/// standard deviations over the launches, then, with `errors`, error_mean, error_sd, error_quantile and
/// error_log_evidence.
std::vector<std::string> filter_columns(const Model& model, const FilterSetup& setup, int highest_moment,
                                        bool errors);
std::vector<double> filter_row(const LaunchesSummary& summary, bool several_launches);
void append(std::vector<double>& row, const AnswerError& error);

}  // namespace wienertree::app
