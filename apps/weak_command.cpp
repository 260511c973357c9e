#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "commands.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "weak_arguments.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct WeakCommandArguments {
  WeakArguments weak;
  std::optional<std::string> output;
  std::optional<TableFormat> format;
  bool quiet = false;
};

Table table_of(const WeakProblem& problem, const WeakResult& result, double seconds) {
  Table table{{"value", "standard_error"}, {}, "payoff", problem.payoffs};
  const bool extrapolated = !result.extrapolated.empty();
  if (extrapolated)
    table.columns.insert(table.columns.end(), {"extrapolated", "extrapolated_standard_error"});
  table.columns.insert(table.columns.end(), {"nodes", "ode_solves", "seconds"});
  for (std::size_t i = 0; i < problem.payoffs.size(); ++i) {
    std::vector<double>& row = table.rows.emplace_back();
    row = {result.value[i], result.standard_error[i]};
    if (extrapolated) row.insert(row.end(), {result.extrapolated[i], result.extrapolated_standard_error[i]});
    row.insert(row.end(),
               {static_cast<double>(result.leaves), static_cast<double>(result.ode_solves), seconds});
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
  report["options"] = std::move(options);
  return report;
}

std::string summary_of(const WeakProblem& problem, const WeakRun& run, const WeakResult& result,
                       double seconds) {
  std::string text =
      fmt::format("{}, t = {:g}: degree {}, {} step{}\n", problem.source.model().name, run.horizon,
                  run.options.formula.degree, run.steps, run.steps == 1 ? "" : "s");
  std::string separator = "  ";
  const Json options = options_in_force(run);
  for (const auto& [name, value] : options.items()) {
    text +=
        fmt::format("{}{} {}", separator, name, value.is_string() ? value.get<std::string>() : value.dump());
    separator = ", ";
  }
  std::size_t width = 0;
  for (const std::string& payoff : problem.payoffs) width = std::max(width, payoff.size());
  text += "\n\n";
  for (std::size_t i = 0; i < problem.payoffs.size(); ++i) {
    text += fmt::format("  E[{}]{:{}} = {:.12g}", problem.payoffs[i], "", width - problem.payoffs[i].size(),
                        result.value[i]);
    if (run.launches > 1) text += fmt::format(" +- {:.2g}", result.standard_error[i]);
    if (run.richardson) text += fmt::format(", extrapolated {:.12g}", result.extrapolated[i]);
    if (run.richardson && run.launches > 1)
      text += fmt::format(" +- {:.2g}", result.extrapolated_standard_error[i]);
    text += '\n';
  }
  return text + fmt::format("\n  {} nodes at the end, {} ODE solves, {:.3g} s\n", result.leaves,
                            result.ode_solves, seconds);
}

void approximate_and_write(const WeakCommandArguments& a) {
  const auto began = std::chrono::steady_clock::now();
  OutputFile output("--output", a.output.value_or("-"));
  const WeakProblem problem = weak_problem(a.weak);
  DrivenFormula driven = weak_formula(a.weak, problem);
  WeakRun run = weak_run(a.weak, problem, std::move(driven.formula));
  const std::size_t trees = run.launches * (run.richardson ? std::size_t{2} : std::size_t{1});
  WeakResult result;
  {
    Progress progress("weak", trees * run.steps, !a.quiet);
    std::size_t done = 0;
    run.options.observe = [&](std::size_t) { progress.advance_to(++done); };
    result = run_weak(driven.model, problem.average, run);
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  const Table table = table_of(problem, result, took.count());
  output.stage(a.format.value_or(TableFormat::csv) == TableFormat::csv
                   ? to_csv(table)
                   : to_json(report_of(a.weak, problem, run), table));
  output.publish();
  if (!a.quiet) std::fputs(summary_of(problem, run, result, took.count()).c_str(), stderr);
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
