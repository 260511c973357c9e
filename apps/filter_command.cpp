#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "filter_arguments.hpp"
#include "filter_report.hpp"
#include "filter_table.hpp"
#include "input_files.hpp"
#include "output.hpp"
#include "signal_file.hpp"
#include "standard_input.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/checksum.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct FilterCommandArguments {
  std::string model;
  Assignments parameters;
  FilterArguments filter;
  std::optional<std::string> observations, inputs, signal, output, plot;
  std::optional<TableFormat> format;
  std::optional<std::uint64_t> moments, steps;
  std::optional<double> density_at;
  AccuracyArguments accuracy;
  CheckpointArguments saving;
  bool quiet = false;
};

std::optional<Curve> signal_of(const std::optional<ObservationPath>& signal, std::size_t state) {
  if (!signal) return {};
  Curve curve{signal->times, {}};
  for (std::size_t r = 0; r < signal->rows(); ++r) curve.y.push_back(signal->row(r)[state]);
  return curve;
}

// Columns of filter_table: the time, means, standard deviations, then three quantiles a state.
Band band_of(const std::vector<std::vector<double>>& rows, std::size_t state, std::size_t states) {
  Band band;
  for (const std::vector<double>& row : rows) {
    band.time.push_back(row[0]);
    band.mean.push_back(row[1 + state]);
    band.low.push_back(row[1 + 2 * states + 3 * state]);
    band.high.push_back(row[3 + 2 * states + 3 * state]);
  }
  return band;
}

std::string draw(Picture picture, const FilterContext& c, const FilterRun& run,
                 const std::optional<ObservationPath>& signal) {
  const std::string what =
      fmt::format("{}: {}, {} steps", c.model.name, describe(run.setup), run.statistics.steps);
  if (!run.density.empty()) {
    std::vector<DensityPanel> panels = run.density;
    for (std::size_t i = 0; i < panels.size(); ++i)
      if (const auto curve = signal_of(signal, i)) panels[i].signal = nearest_value(*curve, run.density_time);
    return draw_density(std::move(picture), fmt::format("{}, t = {:g}", what, run.density_time), panels);
  }
  std::vector<PosteriorPanel> panels;
  const std::size_t states = c.model.reported_dimension();
  for (std::size_t i = 0; i < states; ++i) {
    PosteriorPanel panel{c.model.state_names[i], band_of(run.rows, i, states), {}, signal_of(signal, i)};
    if (!run.exact_rows.empty()) panel.exact = band_of(run.exact_rows, i, states);
    panels.push_back(std::move(panel));
  }
  return draw_posterior(std::move(picture), what, panels);
}

// Everything its results depend on.
Json identity_of(const FilterCommandArguments& a, const FilterContext& c, bool follow) {
  Json run = run_identity("filter");
  run.update(model_identity(a.model, c.model));
  run["observations"] = c.windows.identity();
  run["options"] = options_in_force(c.setup, c.model);
  if (!c.setup.options.formula.paths.empty())
    run["formula's checksum"] = checksum_text(format_formula(c.setup.options.formula));
  run["moments"] = c.highest_moment;
  run["tolerance"] = c.control.tolerance;
  run["work"] = c.control.work;
  if (a.density_at) run["density-at"] = *a.density_at;
  // What is kept of the rows.
  run["with --plot"] = a.plot.has_value();
  run["rows written as they come"] = follow;
  return run;
}

void filter_and_write(const FilterCommandArguments& a) {
  const auto began = std::chrono::steady_clock::now();
  const TextModel source = TextModel::load(model_file(a.model).string(), a.parameters);
  if (source.model().observation == ObservationKind::none)
    throw InputError("the model has no [observation]: there is nothing to filter by",
                     "model " + source.model().name);
  const Model model = with_inputs(source, a.inputs, a.observations).model();
  const FilterSetup setup = filter_setup(a.filter, model);
  if (a.density_at && !a.plot)
    throw InputError("is drawn to the file of --plot, which is missing", "--density-at");
  if (a.signal && !a.plot)
    throw InputError("is drawn to the file of --plot, which is missing", "--signal", *a.signal);
  std::optional<Picture> picture;
  std::optional<OutputFile> plot;
  if (a.plot) {
    picture.emplace(*a.plot);
    plot.emplace("--plot", *a.plot);
  }
  OutputFile output("--output", a.output.value_or("-"));
  std::optional<ObservationPath> signal;
  if (a.signal) signal = read_signal(*a.signal, model);
  const auto windows = windows_of(*a.observations, model, a.steps, a.saving.resume.has_value());

  const int highest_moment = static_cast<int>(a.moments.value_or(0));
  const ControlOptions control = control_options(a.accuracy, a.filter, a.steps, a.moments);
  const FilterContext context{model, setup, *windows, *a.observations, highest_moment, control};
  const bool csv = a.format.value_or(TableFormat::csv) == TableFormat::csv;
  // Rows go out as they come only where they come one by one; a file appears when it is whole.
  const bool follow = windows->streams() && csv && output.target() == "-";
  FilterRequest request;
  request.density_at = a.density_at;
  request.progress = !a.quiet;
  request.keep_rows = !follow || a.plot;
  request.keep_exact_rows = a.plot.has_value();
  request.errors = a.accuracy.errors;
  SavedRun saved(a.saving, identity_of(a, context, follow));
  const std::vector<std::string> columns = filter_columns(model, setup, highest_moment, a.accuracy.errors);
  if (follow) {
    if (!saved.resumes()) write_to_stdout(csv_header(columns));
    request.observe = [](const std::vector<double>& row) { write_to_stdout(csv_row(row)); };
  }
  const std::optional<ObservationRows> record = windows->record();
  FilterRun run = record ? filter_record(model, setup, control, *record, request, saved)
                         : filter_stream(model, setup, control, *windows, request, saved);
  if (plot) plot->stage(draw(*picture, context, run, signal));
  if (!follow) {
    const Table table{columns, std::move(run.rows)};
    output.stage(csv ? to_csv(table) : to_json(filter_report(context, run), table));
    output.publish();
  }
  if (plot) plot->publish();
  // Nodes are never left out without a word.
  if (a.quiet && run.statistics.dropped_nodes > 0) tell(dropped_line(run));
  for (const std::string& text : run.warnings) tell(fmt::format("warning: {}\n", text));
  if (run.collapsed_at) tell(collapse_warning(run));
  if (a.quiet) return;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  tell(filter_summary(context, run, took.count()));
}

}  // namespace

void add_filter_command(CLI::App& program) {
  CLI::App& app =
      *program.add_subcommand("filter", "The law of the signal given its observations, through time");
  const auto a = std::make_shared<FilterCommandArguments>();
  app.add_option("MODEL", a->model, "A bundled model or a TOML file")->required();
  add_text(app, "--observations,OBSERVATIONS", a->observations, "FILE",
           "CSV with header t,y1,..; - is standard input, row by row")
      ->required();
  add_inputs(app, a->inputs);
  add_record_steps(app, a->steps);
  add_filter_options(app, a->filter);
  add_assignments(app, a->parameters);
  add_text(app, "--output", a->output, "FILE", "Where the table goes [standard output]");
  add_choice(app, "--format", a->format, formats, "Of the table [csv]");
  add_moments(app, a->moments);
  add_accuracy_options(app, a->accuracy);
  app.add_flag("--errors", a->accuracy.errors, "Columns with estimates of the errors of each row");
  add_text(app, "--plot", a->plot, "FILE", "A picture of mean and 5-95 % band, .svg or .png");
  add_number(app, "--density-at", a->density_at, Sign::any, "Draw the law at this time instead");
  add_text(app, "--signal", a->signal, "FILE", "The true signal (CSV t,<state>,..), to be drawn as well");
  add_checkpoint_options(app, a->saving);
  add_memory_limit(app);
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(
      "Example:\n"
      "  wienertree filter benes --observations Y.csv --signal X.csv --output posterior.csv --plot "
      "posterior.svg");
  app.callback([a] { filter_and_write(*a); });
}

}  // namespace wienertree::app
