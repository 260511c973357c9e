#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <set>

#include "command_line.hpp"
#include "commands.hpp"
#include "compare_plot.hpp"
#include "compare_run.hpp"
#include "data_directory.hpp"
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
  std::optional<std::string> observations, output, plot;
  std::optional<TableFormat> format;
  std::optional<std::uint64_t> steps;
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
  for (const std::string& text : a.models) {
    if (!labels.insert(text).second) throw InputError("is given twice", "compare", text);
    const ModelArgument argument = parse_model_argument(text);
    Assignments parameters = a.parameters;
    parameters.insert(parameters.end(), argument.parameters.begin(), argument.parameters.end());
    Model model = load_model(model_file(argument.name).string(), parameters);
    if (model.observation == ObservationKind::none)
      throw InputError("the model has no [observation]: there is no evidence", "model " + text);
    if (!all.empty() && (model.observation != all.front().model.observation ||
                         model.observation_dimension() != all.front().model.observation_dimension()))
      throw InputError("models to be compared must observe the same: kind and number of components",
                       "model " + text);
    all.push_back({text, argument.name, std::move(model), {}});
    all.back().setup = filter_setup(a.filter, all.back().model);
  }
  return all;
}

std::vector<std::string> columns(const std::vector<Contender>& all, bool several_launches) {
  std::vector<std::string> names = {"t"};
  const auto add = [&](const char* prefix, std::size_t first) {
    for (std::size_t m = first; m < all.size(); ++m) names.push_back(fmt::format("{}_{}", prefix, m + 1));
  };
  add("log_evidence", 0);
  if (several_launches) add("se_log_evidence", 0);
  add("log_bayes_factor", 1);
  add("probability", 0);
  return names;
}

std::vector<double> row_of(const ComparisonRow& r, bool several_launches) {
  std::vector<double> row = {r.time};
  row.insert(row.end(), r.log_evidence.begin(), r.log_evidence.end());
  if (several_launches) row.insert(row.end(), r.standard_error.begin(), r.standard_error.end());
  for (std::size_t m = 1; m < r.log_evidence.size(); ++m) row.push_back(r.log_bayes_factor(m));
  const std::vector<double> p = r.probabilities();
  row.insert(row.end(), p.begin(), p.end());
  return row;
}

Json report_of(const CompareArguments& a, const std::vector<Contender>& all,
               const std::vector<ComparisonRow>& rows) {
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
    model["options"] = options_in_force(all[m].setup, all[m].model);
    model["log_evidence"] = rows.back().log_evidence[m];
    if (all[m].setup.launches > 1) model["standard_error"] = rows.back().standard_error[m];
    model["probability"] = p[m];
    report["models"].push_back(std::move(model));
  }
  return report;
}

std::string summary_of(const CompareArguments& a, const std::vector<Contender>& all,
                       const std::vector<ComparisonRow>& rows) {
  const ComparisonRow& last = rows.back();
  std::size_t width = 5;
  for (const Contender& c : all) width = std::max(width, c.label.size());
  std::string text = fmt::format("{}, t = {:g} .. {:g}\n", *a.observations, rows.front().time, last.time);
  // A formula that depends on the number of Brownian motions or a default on the dimension may differ.
  std::string before;
  for (const Contender& c : all) {
    const std::string setup = describe(c.setup);
    if (setup != before) text += fmt::format("  {}{}\n", before.empty() ? "" : c.label + ": ", setup);
    before = setup;
  }
  text += fmt::format("\n  {:<{}} {:>16} {:>12} {:>20} {:>12}\n", "model", width, "log evidence",
                      "std. error", "log Bayes factor", "probability");
  const std::vector<double> p = last.probabilities();
  for (std::size_t m = 0; m < all.size(); ++m) {
    const std::string error = all[m].setup.launches > 1 ? fmt::format("{:.2g}", last.standard_error[m])
                              : all[m].setup.random     ? "?"
                                                        : "-";
    text +=
        fmt::format("  {:<{}} {:>16.6f} {:>12} {:>20} {:>12.4g}\n", all[m].label, width, last.log_evidence[m],
                    error, m == 0 ? "" : fmt::format("{:.6f}", last.log_bayes_factor(m)), p[m]);
  }
  text += "\n  Bayes factors are against the first model; probabilities from equal ones before.\n";
  if (all.front().setup.random && all.front().setup.launches == 1)
    text += "  One launch of a random method tells no error: give --launches.\n";
  return text;
}

// Everything the table depends on.
Json identity_of(const std::vector<Contender>& all, const WindowSource& windows) {
  Json run = run_identity("compare");
  run["observations"] = windows.identity();
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
  std::vector<Contender> all = contenders(a);
  if (*a.observations == "-") throw InputError("needs a file: every model reads it", "--observations", "-");
  std::optional<Picture> picture;
  std::optional<OutputFile> plot;
  if (a.plot) {
    picture.emplace(*a.plot);
    plot.emplace("--plot", *a.plot);
  }
  OutputFile output("--output", a.output.value_or("-"));
  std::vector<std::unique_ptr<WindowSource>> windows;
  for (const Contender& c : all) windows.push_back(windows_of(*a.observations, c.model, a.steps));
  SavedRun saved(a.saving, identity_of(all, *windows.front()));
  const std::vector<ComparisonRow> rows = compare(all, windows, !a.quiet, saved);
  const bool several = all.front().setup.launches > 1;
  Table table{columns(all, several), {}};
  for (const ComparisonRow& row : rows) table.rows.push_back(row_of(row, several));
  output.stage(a.format.value_or(TableFormat::csv) == TableFormat::csv
                   ? to_csv(table)
                   : to_json(report_of(a, all, rows), table));
  if (plot) plot->stage(draw_comparison(*picture, all, rows));
  output.publish();
  if (plot) plot->publish();
  if (!a.quiet) std::fputs(summary_of(a, all, rows).c_str(), stderr);
}

}  // namespace

void add_compare_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("compare", "Which of several models the observations speak for");
  const auto a = std::make_shared<CompareArguments>();
  app.add_option("MODEL", a->models,
                 "Bundled models or TOML files; MODEL:NAME=VALUE,.. sets parameters of this one")
      ->required();
  add_text(app, "--observations", a->observations, "FILE", "CSV with header t,y1,..")->required();
  add_record_steps(app, a->steps);
  add_filter_options(app, a->filter);
  add_assignments(app, a->parameters);
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
