#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "commands.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "weak_arguments.hpp"
#include "wienertree/tree/weak_control.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct WeakCommandArguments {
  WeakArguments weak;
  std::optional<std::string> output;
  std::optional<TableFormat> format;
  bool quiet = false;
};

// A row's numbers under their names.
using Cells = std::vector<std::pair<std::string, double>>;

Table table_of(const WeakProblem& problem, const std::vector<Cells>& rows) {
  Table table{{}, {}, "payoff", problem.payoffs};
  for (const auto& [name, value] : rows.front()) table.columns.push_back(name);
  for (const Cells& cells : rows) {
    std::vector<double>& row = table.rows.emplace_back();
    for (const auto& [name, value] : cells) row.push_back(value);
  }
  return table;
}

Json report_of(const WeakArguments& a, const WeakProblem& problem, const WeakRun& run) {
  const Model& model = problem.source.model();
  Json report;
  report["program"] = "wienertree";
  report["version"] = WIENERTREE_VERSION;
  report["command"] = "weak";
  report["model"] = model.name;
  for (const auto& [name, value] : model.parameters) report["parameters"][name] = value;
  Json options = options_in_force(run);
  if (!a.averages.empty()) options["average"] = a.averages;
  if (!a.integrals.empty()) options["integral"] = a.integrals;
  if (a.discount) options["discount"] = *a.discount;
  if (a.tolerance) options["tolerance"] = *a.tolerance;
  if (const double width = kink_width(a, problem); width > 0) options["kink-width"] = width;
  report["options"] = std::move(options);
  return report;
}

std::string summary_of(const WeakArguments& a, const WeakProblem& problem, const WeakRun& run,
                       const std::vector<std::string>& results) {
  std::string text =
      fmt::format("{}, t = {:g}: degree {}, {} step{}\n", problem.source.model().name, run.horizon,
                  run.options.formula.degree, run.steps, run.steps == 1 ? "" : "s");
  std::string separator = "  ";
  const Json options = report_of(a, problem, run)["options"];
  for (const auto& [name, value] : options.items()) {
    text +=
        fmt::format("{}{} {}", separator, name, value.is_string() ? value.get<std::string>() : value.dump());
    separator = ", ";
  }
  std::size_t width = 0;
  for (const std::string& payoff : problem.payoffs) width = std::max(width, payoff.size());
  text += "\n\n";
  for (std::size_t i = 0; i < problem.payoffs.size(); ++i)
    text += fmt::format("  E[{}]{:{}} = {}\n", problem.payoffs[i], "", width - problem.payoffs[i].size(),
                        results[i]);
  return text;
}

// What a run has to show.
struct Outcome {
  std::vector<Cells> rows;
  std::vector<std::string> results;  ///< one a payoff, for people
  WeakRun run;
  std::size_t leaves = 0;
  std::uint64_t ode_solves = 0;
};

Outcome with_given_steps(const WeakArguments& a, const WeakProblem& problem, bool quiet) {
  DrivenFormula driven = weak_formula(a, problem);
  Outcome outcome;
  outcome.run = weak_run(a, problem, std::move(driven.formula));
  WeakRun& run = outcome.run;
  const std::size_t trees = run.launches * (run.richardson ? std::size_t{2} : std::size_t{1});
  Progress progress("weak", trees * run.steps, !quiet);
  std::size_t done = 0;
  run.options.observe = [&](std::size_t) { progress.advance_to(++done); };
  const WeakResult result = run_weak(driven.model, averaged_payoffs(a, problem, 1).front(), run);
  outcome.leaves = result.leaves;
  outcome.ode_solves = result.ode_solves;
  for (std::size_t i = 0; i < problem.payoffs.size(); ++i) {
    Cells& row = outcome.rows.emplace_back();
    std::string& text = outcome.results.emplace_back();
    row = {{"value", result.value[i]}, {"standard_error", result.standard_error[i]}};
    text = fmt::format("{:.12g}", result.value[i]);
    if (run.launches > 1) text += fmt::format(" +- {:.2g}", result.standard_error[i]);
    if (!run.richardson) continue;
    row.insert(row.end(), {{"extrapolated", result.extrapolated[i]},
                           {"extrapolated_standard_error", result.extrapolated_standard_error[i]}});
    text += fmt::format(", extrapolated {:.12g}", result.extrapolated[i]);
    if (run.launches > 1) text += fmt::format(" +- {:.2g}", result.extrapolated_standard_error[i]);
  }
  return outcome;
}

Outcome to_tolerance(const WeakArguments& a, const WeakProblem& problem, bool quiet) {
  WeakTarget target;
  target.tolerance = *a.tolerance;
  target.formulas = weak_formulas(a, problem);
  target.choose_nodes = !a.nodes;
  target.choose_launches = !a.launches;
  target.choose_accuracy = !a.relative_tolerance && !a.absolute_tolerance && a.flow != FlowMethod::exact;
  WeakRun run = weak_run(a, problem, target.formulas.front());
  if (target.choose_nodes && !is_random(run.options))
    run.options.nodes = starting_nodes(problem, run.options.thinning.method);
  if (target.choose_accuracy) run.options.tolerance = {1e-6, 1e-8};
  Progress progress("weak", 0, !quiet);
  std::size_t done = 0;
  run.options.observe = [&](std::size_t) { progress.advance_to(++done); };
  // The narrowest of 10 rungs is 0.21 of the width.
  const ControlledResult result =
      weak_to_tolerance(problem.source.model(), averaged_payoffs(a, problem, 10), run, target);
  Outcome outcome;
  outcome.run = result.run;
  outcome.leaves = result.leaves;
  outcome.ode_solves = result.ode_solves;
  for (std::size_t i = 0; i < problem.payoffs.size(); ++i) {
    const WeakErrorSplit& e = result.error[i];
    outcome.rows.push_back({{"value", result.value[i]},
                            {"standard_error", result.standard_error[i]},
                            {"error", e.total()},
                            {"error_discretisation", e.discretisation},
                            {"error_thinning", e.thinning},
                            {"error_ode", e.ode},
                            {"error_sampling", e.sampling}});
    outcome.results.push_back(
        fmt::format("{:.12g}, error about {:.1e} = discretisation {:.1e} + thinning {:.1e} + ODE {:.1e} + "
                    "sampling {:.1e}",
                    result.value[i], e.total(), e.discretisation, e.thinning, e.ode, e.sampling));
  }
  return outcome;
}

void approximate_and_write(const WeakCommandArguments& a) {
  const auto began = std::chrono::steady_clock::now();
  OutputFile output("--output", a.output.value_or("-"));
  const WeakProblem problem = weak_problem(a.weak);
  Outcome outcome =
      a.weak.tolerance ? to_tolerance(a.weak, problem, a.quiet) : with_given_steps(a.weak, problem, a.quiet);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  for (Cells& row : outcome.rows)
    row.insert(row.end(), {{"nodes", static_cast<double>(outcome.leaves)},
                           {"ode_solves", static_cast<double>(outcome.ode_solves)},
                           {"seconds", took.count()}});
  const Table table = table_of(problem, outcome.rows);
  output.stage(a.format.value_or(TableFormat::csv) == TableFormat::csv
                   ? to_csv(table)
                   : to_json(report_of(a.weak, problem, outcome.run), table));
  output.publish();
  if (a.quiet) return;
  const std::string work = fmt::format("\n  {} nodes at the end, {} ODE solves, {:.3g} s\n", outcome.leaves,
                                       outcome.ode_solves, took.count());
  std::fputs((summary_of(a.weak, problem, outcome.run, outcome.results) + work).c_str(), stderr);
}

}  // namespace

void add_weak_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("weak", "Averages of payoffs at a time: weak approximation");
  const auto a = std::make_shared<WeakCommandArguments>();
  add_weak_options(app, a->weak);
  add_text(app, "--output", a->output, "FILE", "Where the table goes [standard output]");
  add_choice(app, "--format", a->format, formats, "Of the table [csv]");
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(
      "Example:\n"
      "  wienertree weak heston --horizon 1 --steps 8 --average s --payoff \"max(average_s - 1.05, 0)\"");
  app.callback([a] { approximate_and_write(*a); });
}

}  // namespace wienertree::app
