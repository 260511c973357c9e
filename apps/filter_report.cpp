#include "filter_report.hpp"
#include "filter_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "filter_table.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

std::string line_of_numbers(const std::string& name, std::span<const double> numbers) {
  std::string line = fmt::format("  {:<22}", name);
  for (const double number : numbers) line += fmt::format(" {:>12.6g}", number);
  return line + '\n';
}

std::vector<double> final_numbers(const PosteriorSummary& s, std::size_t i) {
  return {s.mean[i], s.sd[i], s.q05[i], s.q50[i], s.q95[i]};
}

std::string what_was_run(const FilterContext& c, const FilterRun& run) {
  std::string text = fmt::format("{} on {}, {}, {} rows, t = {:g} .. {:g}, {} steps\n", describe(run.setup),
                                 c.model.name, c.observations == "-" ? "standard input" : c.observations,
                                 c.windows.rows(), run.start, run.last.mean.time, run.statistics.steps);
  std::string separator = "  ";
  const Json options = options_in_force(run.setup, c.model);
  for (const auto& [name, value] : options.items()) {
    const std::string shown = value.is_string() ? value.get<std::string>() : value.dump();
    text += fmt::format("{}{} {}", separator, name, shown);
    separator = ", ";
  }
  return text + '\n';
}

std::string final_posterior(const FilterContext& c, const FilterRun& run) {
  const LaunchesSummary& last = run.last;
  std::string text =
      fmt::format("\n  {:<22} {:>12} {:>12} {:>12} {:>12} {:>12}\n",
                  fmt::format("posterior at t = {:g}", last.mean.time), "mean", "sd", "5 %", "50 %", "95 %");
  for (std::size_t i = 0; i < states_of(c.model).size(); ++i) {
    const std::vector<double> ours = final_numbers(last.mean, i);
    text += line_of_numbers(states_of(c.model)[i], ours);
    if (c.setup.launches > 1) text += line_of_numbers("  sd over launches", std::span(&last.mean_sd[i], 1));
    if (!run.exact) continue;
    std::vector<double> exact = final_numbers(*run.exact, i);
    text += line_of_numbers("  exact", exact);
    for (std::size_t k = 0; k < exact.size(); ++k) exact[k] = ours[k] - exact[k];
    text += line_of_numbers("  difference", exact);
  }
  return text + '\n';
}

std::string evidence_line(const FilterContext& c, const FilterRun& run) {
  const LaunchesSummary& last = run.last;
  std::string text = fmt::format("  log evidence {:.6f}", last.mean.log_evidence);
  if (c.setup.launches > 1) text += fmt::format(" (sd over launches {:.2g})", last.log_evidence_sd);
  if (run.exact)
    text += fmt::format(", exact {:.6f}, difference {:.2g}", run.exact->log_evidence,
                        last.mean.log_evidence - run.exact->log_evidence);
  return text + '\n';
}

std::string error_line(const FilterRun& run) {
  if (!run.error_known) return "  errors: not known\n";
  return fmt::format(
      "  errors at most about {:.1e} in means, {:.1e} in standard deviations, {:.1e} in quantiles (in "
      "posterior "
      "standard deviations), {:.1e} in log evidence\n",
      run.error.mean, run.error.sd, run.error.quantile, run.error.log_evidence);
}

std::string ratio_lines(const FilterRun& run) {
  const std::optional<LikelihoodRatio>& ratio = run.last.ratio;
  if (!ratio) return {};
  return fmt::format(
      "  against noise alone: log Bayes factor {:.6f}, log variance of the likelihood ratio {:.6g}, {:.4g} "
      "effective "
      "particles\n",
      ratio->log_mean, ratio->log_variance, ratio->effective_size);
}

std::string work_line(const FilterContext& c, const FilterRun& run, double seconds) {
  const FilterStatistics& s = run.statistics;
  std::string text;
  if (keeps_nodes(c.setup.options.method)) {
    text = fmt::format("  {:g} nodes kept at the end, {} grown, {} ODE solves", run.last.nodes, s.children,
                       s.flow.node_segments);
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

Json filter_report(const FilterContext& c, const FilterRun& run) {
  Json report;
  report["program"] = "wienertree";
  report["version"] = WIENERTREE_VERSION;
  report["command"] = "filter";
  report["model"] = c.model.name;
  for (const auto& [name, value] : c.model.parameters) report["parameters"][name] = value;
  report["observations"] = c.observations;
  report["rows_read"] = c.windows.rows();
  Json options = options_in_force(run.setup, c.model);
  options["steps"] = run.statistics.steps;
  options["tolerance"] = c.control.tolerance;
  options["work"] = c.control.work;
  if (c.highest_moment > 0) options["moments"] = c.highest_moment;
  if (c.model.inputs) options["inputs"] = c.model.inputs->origin();
  report["options"] = std::move(options);
  report["children"] = run.statistics.children;
  report["ode_solves"] = run.statistics.flow.node_segments;
  if (run.error_known) {
    report["error_mean"] = run.error.mean;
    report["error_sd"] = run.error.sd;
    report["error_quantile"] = run.error.quantile;
    report["error_log_evidence"] = run.error.log_evidence;
  }
  if (!run.warnings.empty()) report["warnings"] = run.warnings;
  report["dropped_nodes"] = run.statistics.dropped_nodes;
  if (recombines(c.setup.options.thinning.method)) report["discarded"] = run.statistics.discarded;
  if (!run.exact) return report;
  Json exact;
  exact["filter"] = method_name(*exact_method(c.model));
  for (std::size_t i = 0; i < states_of(c.model).size(); ++i) {
    exact["mean_" + states_of(c.model)[i]] = run.exact->mean[i];
    exact["sd_" + states_of(c.model)[i]] = run.exact->sd[i];
  }
  exact["log_evidence"] = run.exact->log_evidence;
  report["exact_at_end"] = std::move(exact);
  return report;
}

std::string dropped_line(const FilterRun& run) {
  return fmt::format("wienertree: {} of {} nodes could not be moved and were dropped\n",
                     run.statistics.dropped_nodes, run.statistics.children);
}

std::string collapse_warning(const FilterRun& run) {
  return fmt::format(
      "warning: the weights collapsed at t = {:g}: fewer than 10 effective particles, so that what is "
      "reported from "
      "then on rests on a few of them\n",
      *run.collapsed_at);
}

std::string filter_summary(const FilterContext& context, const FilterRun& run, double seconds) {
  return what_was_run(context, run) + final_posterior(context, run) + evidence_line(context, run) +
         error_line(run) + ratio_lines(run) + work_line(context, run, seconds);
}

}  // namespace wienertree::app
