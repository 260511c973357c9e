#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <set>

#include "command_line.hpp"
#include "commands.hpp"
#include "compare_plot.hpp"
#include "compare_run.hpp"
#include "data_directory.hpp"
#include "input_files.hpp"
#include "output.hpp"
#include "standard_input.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/checksum.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct CompareArguments {
  std::vector<std::string> models;
  FilterArguments filter;
  Assignments parameters;
  std::optional<std::string> observations, inputs, output, plot;
  std::optional<TableFormat> format;
  std::optional<std::uint64_t> steps;
  AccuracyArguments accuracy;
  CheckpointArguments saving;
  bool quiet = false;
};

// "MODEL:beta=0.7,phi=0.95": parameters of this model only. A path may hold a colon; what follows the last
// one and has the form of assignments is taken for them.
struct ModelArgument {
  std::string name;
  Assignments parameters;
};

ModelArgument parse_model_argument(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || text.find('=', colon) == std::string::npos) return {text, {}};
  ModelArgument model{text.substr(0, colon), {}};
  std::string rest = text.substr(colon + 1);
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    more = comma != std::string::npos;
    model.parameters.push_back(parse_assignment(rest.substr(0, comma), text));
    rest = more ? rest.substr(comma + 1) : "";
  }
  return model;
}

std::vector<Contender> contenders(const CompareArguments& a) {
  if (a.models.size() < 2)
    throw InputError("needs two models or more, or two sets of parameters of one: MODEL:NAME=VALUE,..",
                     "compare");
  std::vector<Contender> all;
  std::set<std::string> labels;
  bool given = false;
  for (const std::string& text : a.models) {
    if (!labels.insert(text).second) throw InputError("is given twice", "compare", text);
    const ModelArgument argument = parse_model_argument(text);
    Assignments parameters = a.parameters;
    parameters.insert(parameters.end(), argument.parameters.begin(), argument.parameters.end());
    const TextModel source = TextModel::load(model_file(argument.name).string(), parameters);
    // A file of inputs is for those that have some.
    Model model =
        with_inputs(source, source.model().inputs ? a.inputs : std::nullopt, a.observations).model();
    given = given || model.inputs;
    if (model.observation == ObservationKind::none)
      throw InputError("the model has no [observation]: there is no evidence", "model " + text);
    if (!all.empty() && (model.observation != all.front().model.observation ||
                         model.observation_dimension() != all.front().model.observation_dimension()))
      throw InputError("models to be compared must observe the same: kind and number of components",
                       "model " + text);
    all.push_back({text, argument.name, std::move(model), {}});
    all.back().setup = filter_setup(a.filter, all.back().model);
  }
  if (a.inputs && !given) throw InputError("no model has [inputs]", "--inputs", *a.inputs);
  return all;
}

std::vector<std::string> columns(const std::vector<Contender>& all, bool several_launches, bool errors) {
  std::vector<std::string> names = {"t"};
  const auto add = [&](const char* prefix, std::size_t first) {
    for (std::size_t m = first; m < all.size(); ++m) names.push_back(fmt::format("{}_{}", prefix, m + 1));
  };
  add("log_evidence", 0);
  if (several_launches) add("se_log_evidence", 0);
  if (errors) add("error_log_evidence", 0);
  add("log_bayes_factor", 1);
  add("probability", 0);
  return names;
}

std::vector<double> row_of(const ComparisonRow& r, bool several_launches, bool errors) {
  std::vector<double> row = {r.time};
  row.insert(row.end(), r.log_evidence.begin(), r.log_evidence.end());
  if (several_launches) row.insert(row.end(), r.standard_error.begin(), r.standard_error.end());
  if (errors) row.insert(row.end(), r.error.begin(), r.error.end());
  for (std::size_t m = 1; m < r.log_evidence.size(); ++m) row.push_back(r.log_bayes_factor(m));
  const std::vector<double> p = r.probabilities();
  row.insert(row.end(), p.begin(), p.end());
  return row;
}

Json report_of(const CompareArguments& a, const std::vector<Contender>& all, const Comparison& comparison) {
  const std::vector<ComparisonRow>& rows = comparison.rows;
  Json report;
  report["program"] = "wienertree";
  report["version"] = WIENERTREE_VERSION;
  report["command"] = "compare";
  report["observations"] = *a.observations;
  const std::vector<double> p = rows.back().probabilities();
  for (std::size_t m = 0; m < all.size(); ++m) {
    Json model;
    model["model"] = all[m].label;
    for (const auto& [name, value] : all[m].model.parameters) model["parameters"][name] = value;
    model["options"] = options_in_force(comparison.setup[m], all[m].model);
    if (all[m].model.inputs) model["options"]["inputs"] = all[m].model.inputs->origin();
    model["log_evidence"] = rows.back().log_evidence[m];
    if (all[m].setup.launches > 1) model["standard_error"] = rows.back().standard_error[m];
    if (std::isfinite(comparison.error[m])) model["error_log_evidence"] = comparison.error[m];
    if (!comparison.warnings[m].empty()) model["warnings"] = comparison.warnings[m];
    model["probability"] = p[m];
    report["models"].push_back(std::move(model));
  }
  return report;
}

// A sentence for each model whose difference from the first is not above the errors of both.
std::vector<std::string> undecided(const std::vector<Contender>& all, const Comparison& comparison) {
  std::vector<std::string> sentences;
  const std::vector<double>& l = comparison.rows.back().log_evidence;
  for (std::size_t m = 1; m < all.size(); ++m)
    if (comparison.undecided(0, m))
      sentences.push_back(fmt::format(
          "the log evidences of {} and {} differ by {:.2g}, and their errors may be {:.2g}: no preference "
          "can be told",
          all.front().label, all[m].label, std::abs(l[m] - l[0]), comparison.error[0] + comparison.error[m]));
  return sentences;
}

std::string summary_of(const CompareArguments& a, const std::vector<Contender>& all,
                       const Comparison& comparison) {
  const std::vector<ComparisonRow>& rows = comparison.rows;
  const ComparisonRow& last = rows.back();
  std::size_t width = 5;
  for (const Contender& c : all) width = std::max(width, c.label.size());
  std::string text = fmt::format("{}, t = {:g} .. {:g}\n", *a.observations, rows.front().time, last.time);
  // A formula that depends on the number of Brownian motions or a default on the dimension may differ.
  std::string before;
  for (std::size_t m = 0; m < all.size(); ++m) {
    const std::string setup = describe(comparison.setup[m]);
    if (setup != before) text += fmt::format("  {}{}\n", before.empty() ? "" : all[m].label + ": ", setup);
    before = setup;
  }
  text += fmt::format("\n  {:<{}} {:>16} {:>12} {:>20} {:>12}\n", "model", width, "log evidence", "error",
                      "log Bayes factor", "probability");
  const std::vector<double> p = last.probabilities();
  for (std::size_t m = 0; m < all.size(); ++m) {
    const std::string error =
        std::isfinite(comparison.error[m]) ? fmt::format("{:.2g}", comparison.error[m]) : "?";
    text +=
        fmt::format("  {:<{}} {:>16.6f} {:>12} {:>20} {:>12.4g}\n", all[m].label, width, last.log_evidence[m],
                    error, m == 0 ? "" : fmt::format("{:.6f}", last.log_bayes_factor(m)), p[m]);
  }
  return text + "\n  Bayes factors are against the first model; probabilities from equal ones before.\n";
}

// Everything the table depends on.
Json identity_of(const std::vector<Contender>& all, const WindowSource& windows,
                 const ControlOptions& control) {
  Json run = run_identity("compare");
  run["observations"] = windows.identity();
  run["tolerance"] = control.tolerance;
  run["work"] = control.work;
  for (const Contender& c : all) {
    Json model = model_identity(c.file, c.model);
    model["label"] = c.label;
    model["options"] = options_in_force(c.setup, c.model);
    if (!c.setup.options.formula.paths.empty())
      model["formula's checksum"] = checksum_text(format_formula(c.setup.options.formula));
    run["models"].push_back(std::move(model));
  }
  return run;
}

void compare_and_write(const CompareArguments& a) {
  if (*a.observations == "-") throw InputError("needs a file: every model reads it", "--observations", "-");
  std::vector<Contender> all = contenders(a);
  std::optional<Picture> picture;
  std::optional<OutputFile> plot;
  if (a.plot) {
    picture.emplace(*a.plot);
    plot.emplace("--plot", *a.plot);
  }
  OutputFile output("--output", a.output.value_or("-"));
  std::vector<std::unique_ptr<WindowSource>> windows;
  for (const Contender& c : all) windows.push_back(windows_of(*a.observations, c.model, a.steps));
  const ControlOptions control = control_options(a.accuracy, a.filter, a.steps, {});
  std::vector<ObservationRows> records;
  for (const auto& source : windows) records.push_back(*source->record());
  SavedRun saved(a.saving, identity_of(all, *windows.front(), control));
  const Comparison comparison = compare(all, control, records, !a.quiet, saved);
  const std::vector<ComparisonRow>& rows = comparison.rows;
  const bool several = all.front().setup.launches > 1, errors = a.accuracy.errors;
  Table table{columns(all, several, errors), {}};
  for (const ComparisonRow& row : rows) table.rows.push_back(row_of(row, several, errors));
  output.stage(a.format.value_or(TableFormat::csv) == TableFormat::csv
                   ? to_csv(table)
                   : to_json(report_of(a, all, comparison), table));
  if (plot) plot->stage(draw_comparison(*picture, all, rows));
  output.publish();
  if (plot) plot->publish();
  for (std::size_t m = 0; m < all.size(); ++m)
    for (const std::string& text : comparison.warnings[m])
      tell(fmt::format("warning: {}: {}\n", all[m].label, text));
  for (const std::string& text : undecided(all, comparison)) tell(fmt::format("warning: {}\n", text));
  if (!a.quiet) tell(summary_of(a, all, comparison));
}

}  // namespace

void add_compare_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("compare", "Which of several models the observations speak for");
  const auto a = std::make_shared<CompareArguments>();
  app.add_option("MODEL", a->models,
                 "Bundled models or TOML files; MODEL:NAME=VALUE,.. sets parameters of this one")
      ->required();
  add_text(app, "--observations", a->observations, "FILE", "CSV with header t,y1,..")->required();
  add_inputs(app, a->inputs);
  add_record_steps(app, a->steps);
  add_filter_options(app, a->filter);
  add_assignments(app, a->parameters);
  add_accuracy_options(app, a->accuracy);
  app.add_flag("--errors", a->accuracy.errors, "Columns with estimates of the errors of the log evidences");
  add_text(app, "--output", a->output, "FILE", "Where the table goes [standard output]");
  add_choice(app, "--format", a->format, formats, "Of the table [csv]");
  add_text(app, "--plot", a->plot, "FILE",
           "A picture of log Bayes factors and probabilities through time, .svg or .png");
  add_checkpoint_options(app, a->saving);
  add_memory_limit(app);
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(
      "Example:\n"
      "  wienertree compare stochastic-volatility stochastic-volatility:phi=0.95,s=0.3,beta=0.7 "
      "--observations dax.csv "
      "--plot bayes.svg");
  app.callback([a] { compare_and_write(*a); });
}

}  // namespace wienertree::app
