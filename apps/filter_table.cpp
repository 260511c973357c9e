#include "filter_table.hpp"

#include <fmt/format.h>

namespace wienertree::app {

std::span<const std::string> states_of(const Model& model) {
  return {model.state_names.data(), model.reported_dimension()};
}

std::vector<std::string> filter_columns(const Model& model, const FilterSetup& setup, int highest_moment,
                                        bool errors) {
  std::vector<std::string> columns = {"t"};
  for (const char* prefix : {"mean_", "sd_"})
    for (const std::string& state : states_of(model)) columns.push_back(prefix + state);
  for (const std::string& state : states_of(model))
    for (const char* prefix : {"q05_", "q50_", "q95_"}) columns.push_back(prefix + state);
  for (const char* name : {"log_evidence", "nodes", "ess"}) columns.emplace_back(name);
  for (int k = 2; k <= highest_moment; ++k)
    for (const std::string& state : states_of(model)) columns.push_back(fmt::format("m{}_{}", k, state));
  if (setup.options.method == FilterMethod::weighted)
    for (const char* name : {"log_bayes_factor", "log_variance"}) columns.emplace_back(name);
  if (setup.launches > 1) {
    for (const std::string& state : states_of(model)) columns.push_back("mc_sd_" + state);
    columns.emplace_back("mc_sd_log_evidence");
  }
  if (errors)
    for (const char* name : {"error_mean", "error_sd", "error_quantile", "error_log_evidence"})
      columns.emplace_back(name);
  return columns;
}

std::vector<double> filter_row(const LaunchesSummary& summary, bool several_launches) {
  const PosteriorSummary& s = summary.mean;
  std::vector<double> row = {s.time};
  row.insert(row.end(), s.mean.begin(), s.mean.end());
  row.insert(row.end(), s.sd.begin(), s.sd.end());
  for (std::size_t i = 0; i < s.mean.size(); ++i) row.insert(row.end(), {s.q05[i], s.q50[i], s.q95[i]});
  row.insert(row.end(), {s.log_evidence, summary.nodes, s.ess});
  for (std::size_t k = 0; k < (s.moments.empty() ? 0 : s.moments.front().size()); ++k)
    for (const std::vector<double>& moments : s.moments) row.push_back(moments[k]);
  if (summary.ratio) row.insert(row.end(), {summary.ratio->log_mean, summary.ratio->log_variance});
  if (!several_launches) return row;
  row.insert(row.end(), summary.mean_sd.begin(), summary.mean_sd.end());
  row.push_back(summary.log_evidence_sd);
  return row;
}

void append(std::vector<double>& row, const AnswerError& e) {
  row.insert(row.end(), {e.mean, e.sd, e.quantile, e.log_evidence});
}

}  // namespace wienertree::app
