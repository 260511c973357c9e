#include "filter_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

std::span<const std::string> states_of(const Model& model) {
  return {model.state_names.data(), model.reported_dimension()};
}

// The functional that the data allowed.
std::string functional_in_force(const FilterContext& c) {
  const std::string asked = options_in_force(c.setup, c.model).value("functional", "");
  return asked == "second-order" && !c.windows.has_inner_rows() ? "trapezoid" : asked;
}

std::string line_of_numbers(const std::string& name, std::span<const double> numbers) {
  std::string line = fmt::format("  {:<22}", name);
  for (const double number : numbers) line += fmt::format(" {:>12.6g}", number);
  return line + '\n';
}

std::vector<double> final_numbers(const PosteriorSummary& s, std::size_t i) {
  return {s.mean[i], s.sd[i], s.q05[i], s.q50[i], s.q95[i]};
}

std::string what_was_run(const FilterContext& c, const FilterRun& run) {
  std::string text =
      fmt::format("{} on {}, {}, {} rows, t = {:g} .. {:g}, {} steps\n", describe(c.setup), c.model.name,
                  c.observations == "-" ? "standard input" : c.observations, c.windows.rows(),
                  c.windows.start(), run.rows.back().mean.time, run.statistics.steps);
  std::string separator = "  ";
  const Json options = options_in_force(c.setup, c.model);
  for (const auto& [name, value] : options.items()) {
    const std::string shown = value.is_string() ? value.get<std::string>() : value.dump();
    text += fmt::format("{}{} {}", separator, name, shown);
    if (name == "functional" && functional_in_force(c) != shown)
      text += fmt::format(" (as {}: no rows inside the steps)", functional_in_force(c));
    separator = ", ";
  }
  return text + '\n';
}

std::string final_posterior(const FilterContext& c, const FilterRun& run) {
  const LaunchesSummary& last = run.rows.back();
  std::string text =
      fmt::format("\n  {:<22} {:>12} {:>12} {:>12} {:>12} {:>12}\n",
                  fmt::format("posterior at t = {:g}", last.mean.time), "mean", "sd", "5 %", "50 %", "95 %");
  for (std::size_t i = 0; i < states_of(c.model).size(); ++i) {
    const std::vector<double> ours = final_numbers(last.mean, i);
    text += line_of_numbers(states_of(c.model)[i], ours);
    if (c.setup.launches > 1) text += line_of_numbers("  sd over launches", std::span(&last.mean_sd[i], 1));
    if (run.exact.empty()) continue;
    std::vector<double> exact = final_numbers(run.exact.back(), i);
    text += line_of_numbers("  exact", exact);
    for (std::size_t k = 0; k < exact.size(); ++k) exact[k] = ours[k] - exact[k];
    text += line_of_numbers("  difference", exact);
  }
  return text + '\n';
}

std::string evidence_line(const FilterContext& c, const FilterRun& run) {
  const LaunchesSummary& last = run.rows.back();
  std::string text = fmt::format("  log evidence {:.6f}", last.mean.log_evidence);
  if (c.setup.launches > 1) text += fmt::format(" (sd over launches {:.2g})", last.log_evidence_sd);
  if (!run.exact.empty())
    text += fmt::format(", exact {:.6f}, difference {:.2g}", run.exact.back().log_evidence,
                        last.mean.log_evidence - run.exact.back().log_evidence);
  return text + '\n';
}

std::string ratio_lines(const FilterRun& run) {
  const std::optional<LikelihoodRatio>& ratio = run.rows.back().ratio;
  if (!ratio) return {};
  std::string text = fmt::format(
      "  against noise alone: log Bayes factor {:.6f}, log variance of the likelihood ratio {:.6g}, {:.4g} "
      "effective "
      "particles\n",
      ratio->log_mean, ratio->log_variance, ratio->effective_size);
  const auto collapsed = [](const LaunchesSummary& row) { return row.ratio && row.ratio->collapsed(); };
  const auto first = std::find_if(run.rows.begin(), run.rows.end(), collapsed);
  if (first != run.rows.end())
    text += fmt::format(
        "  warning: the weights collapsed at t = {:g}: fewer than 10 effective particles, so that what is "
        "reported from "
        "then on rests on a few of them\n",
        first->mean.time);
  return text;
}

std::string work_line(const FilterContext& c, const FilterRun& run, double seconds) {
  const FilterStatistics& s = run.statistics;
  std::string text;
  if (keeps_nodes(c.setup.options.method)) {
    text = fmt::format("  {:g} nodes kept at the end, {} grown, {} ODE solves", run.rows.back().nodes,
                       s.children, s.flow.node_segments);
    if (s.flow.cvode_nodes > 0) text += fmt::format(" ({} by CVODE)", s.flow.cvode_nodes);
    if (recombines(c.setup.options.thinning.method)) text += fmt::format(", {:.2g} discarded", s.discarded);
    if (s.dropped_nodes > 0) text += fmt::format(", {} nodes dropped", s.dropped_nodes);
    text += ", ";
  } else {
    text = "  ";
  }
  return text + fmt::format("{:.3g} s\n", seconds);
}

}  // namespace

std::vector<std::string> filter_columns(const Model& model, const FilterSetup& setup, int highest_moment) {
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
  if (setup.launches == 1) return columns;
  for (const std::string& state : states_of(model)) columns.push_back("mc_sd_" + state);
  columns.emplace_back("mc_sd_log_evidence");
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

Json filter_report(const FilterContext& c, const FilterRun& run) {
  Json report;
  report["program"] = "wienertree";
  report["version"] = WIENERTREE_VERSION;
  report["command"] = "filter";
  report["model"] = c.model.name;
  for (const auto& [name, value] : c.model.parameters) report["parameters"][name] = value;
  report["observations"] = c.observations;
  report["rows_read"] = c.windows.rows();
  Json options = options_in_force(c.setup, c.model);
  options["steps"] = run.statistics.steps;
  if (c.highest_moment > 0) options["moments"] = c.highest_moment;
  report["options"] = std::move(options);
  if (c.model.observation == ObservationKind::continuous && keeps_nodes(c.setup.options.method))
    report["functional_in_force"] = functional_in_force(c);
  report["children"] = run.statistics.children;
  report["ode_solves"] = run.statistics.flow.node_segments;
  report["dropped_nodes"] = run.statistics.dropped_nodes;
  if (recombines(c.setup.options.thinning.method)) report["discarded"] = run.statistics.discarded;
  if (run.exact.empty()) return report;
  Json exact;
  exact["filter"] = method_name(*exact_method(c.model));
  for (std::size_t i = 0; i < states_of(c.model).size(); ++i) {
    exact["mean_" + states_of(c.model)[i]] = run.exact.back().mean[i];
    exact["sd_" + states_of(c.model)[i]] = run.exact.back().sd[i];
  }
  exact["log_evidence"] = run.exact.back().log_evidence;
  report["exact_at_end"] = std::move(exact);
  return report;
}

std::string filter_summary(const FilterContext& context, const FilterRun& run, double seconds) {
  return what_was_run(context, run) + final_posterior(context, run) + evidence_line(context, run) +
         ratio_lines(run) + work_line(context, run, seconds);
}

}  // namespace wienertree::app
