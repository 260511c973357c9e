#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "commands.hpp"
#include "input_files.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "saved_run.hpp"
#include "weak_outcome.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/run/checksum.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct WeakCommandArguments {
  WeakArguments weak;
  std::optional<std::string> output;
  std::optional<TableFormat> format;
  CheckpointArguments saving;
  bool quiet = false;
};

Table table_of(const std::vector<std::string>& payoffs, const std::vector<NamedNumbers>& rows) {
  Table table{{}, {}, "payoff", payoffs};
  for (const auto& [name, value] : rows.front()) table.columns.push_back(name);
  for (const NamedNumbers& cells : rows) {
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
  if (a.inputs) options["inputs"] = *a.inputs;
  if (a.tolerance) options["tolerance"] = *a.tolerance;
  note_kinks(a, problem, options);
  if (problem.transition) {
    for (const char* followed : {"formula", "flow", "rtol", "atol"}) options.erase(followed);
    options["square-roots"] = "auto";
  }
  report["options"] = std::move(options);
  return report;
}

std::string summary_of(const WeakArguments& a, const WeakProblem& problem, const WeakOutcome& outcome) {
  const WeakRun& run = outcome.run;
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
  text += "\n\n";
  std::vector<std::string> names;
  std::size_t width = 0;
  for (std::size_t i = 0; i < outcome.payoffs.size(); ++i) {
    names.push_back(fmt::format("E[{}]", outcome.payoffs[i]));
    if (run.horizons.size() > 1)
      names.back() = fmt::format("t = {:g}: {}", outcome.rows[i].front().second, names.back());
    width = std::max(width, names.back().size());
  }
  for (std::size_t i = 0; i < names.size(); ++i)
    text += fmt::format("  {:{}} = {}\n", names[i], width, outcome.results[i]);
  for (const std::string& note : outcome.notes) text += fmt::format("  note: {}\n", note);
  return text;
}

// Everything the values depend on: the options as they were given, for --tolerance chooses others as it goes.
Json identity_of(const WeakArguments& a, const WeakProblem& problem) {
  Json run = run_identity("weak");
  run.update(model_identity(a.model, problem.source.model()));
  run["payoffs"] = a.payoffs;
  const std::vector<CubatureFormula> formulas =
      a.tolerance ? weak_formulas(a, problem) : std::vector{weak_formula(a, problem).formula};
  for (const CubatureFormula& formula : formulas)
    run["formulas' checksums"].push_back(checksum_text(format_formula(formula)));
  run["options"] = report_of(a, problem, weak_run(a, problem, formulas.front()))["options"];
  const auto note = [&run](const char* name, const auto& value) {
    if (value) run["options given"][name] = *value;
  };
  note("nodes", a.nodes);
  note("launches", a.launches);
  note("rtol", a.relative_tolerance);
  note("atol", a.absolute_tolerance);
  return run;
}

void summarise(const WeakArguments& a, const WeakProblem& problem, const WeakOutcome& outcome,
               double seconds) {
  const std::string work = fmt::format("\n  {} nodes at the end, {} ODE solves, {:.3g} s\n", outcome.leaves,
                                       outcome.ode_solves, seconds);
  tell(summary_of(a, problem, outcome) + work);
}

void approximate_and_write(const WeakCommandArguments& a) {
  const auto began = std::chrono::steady_clock::now();
  OutputFile output("--output", a.output.value_or("-"));
  const WeakProblem problem = weak_problem(a.weak);
  WeakOutcome outcome;
  SavedRun saved(a.saving, identity_of(a.weak, problem));
  WeakJournal journal;
  double seconds_before = 0;  // of the run that is taken up
  const auto seconds = [&] {
    return seconds_before + std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  };
  std::size_t done = 0;
  const Exchange exchange = [&](StateArchive& archive) {
    double so_far = seconds();
    archive(so_far, done);
    if (archive.reading()) seconds_before = so_far;
    journal.exchange(archive);
  };
  saved.resume(exchange);
  {
    std::optional<Progress> progress;
    const WeakObserver observer = {[&](std::size_t steps) { progress.emplace("weak", steps, !a.quiet); },
                                   [&] {
                                     progress->advance_to(++done);
                                     if (saved.interrupted())
                                       saved.finish(exchange, fmt::format("step {}", done));
                                     saved.after_step(exchange);
                                   },
                                   &journal};
    outcome = a.weak.tolerance ? weak_to_tolerance(a.weak, problem, observer)
                               : weak_with_steps(a.weak, problem, weak_formula(a.weak, problem), 0, observer);
  }
  saved.finish(exchange, "the end");
  const double took = seconds();
  for (NamedNumbers& row : outcome.rows)
    row.insert(row.end(), {{"nodes", static_cast<double>(outcome.leaves)},
                           {"ode_solves", static_cast<double>(outcome.ode_solves)},
                           {"seconds", took}});
  const Table table = table_of(outcome.payoffs, outcome.rows);
  output.stage(a.format.value_or(TableFormat::csv) == TableFormat::csv
                   ? to_csv(table)
                   : to_json(report_of(a.weak, problem, outcome.run), table));
  output.publish();
  if (!a.quiet) summarise(a.weak, problem, outcome, took);
  if (outcome.warning.empty()) return;
  tell(fmt::format("warning: tolerance {:g}: {}\n", *a.weak.tolerance, outcome.warning));
  throw SaidAlready{1};
}

}  // namespace

void add_weak_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("weak", "Averages of payoffs at a time: weak approximation");
  const auto a = std::make_shared<WeakCommandArguments>();
  add_weak_options(app, a->weak);
  add_inputs(app, a->weak.inputs);
  add_text(app, "--output", a->output, "FILE", "Where the table goes [standard output]");
  add_choice(app, "--format", a->format, formats, "Of the table [csv]");
  add_checkpoint_options(app, a->saving);
  add_memory_limit(app);
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(
      "Example:\n"
      "  wienertree weak heston --horizon 1 --steps 8 --average s --payoff \"max(average_s - 1.05, 0)\"");
  app.callback([a] { approximate_and_write(*a); });
}

}  // namespace wienertree::app
