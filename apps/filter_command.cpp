#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "data_directory.hpp"
#include "filter_report.hpp"
#include "output.hpp"
#include "signal_file.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::app {
namespace {

const Choices<TableFormat> formats = {{"csv", TableFormat::csv}, {"json", TableFormat::json}};

struct FilterCommandArguments {
  std::string model;
  Assignments parameters;
  FilterArguments filter;
  std::optional<std::string> observations, signal, output, plot;
  std::optional<TableFormat> format;
  std::optional<std::uint64_t> moments, steps;
  std::optional<double> density_at;
  bool quiet = false;
};

std::optional<Curve> signal_of(const std::optional<ObservationPath>& signal, std::size_t state) {
  if (!signal) return {};
  Curve curve{signal->times, {}};
  for (std::size_t r = 0; r < signal->rows(); ++r) curve.y.push_back(signal->row(r)[state]);
  return curve;
}

template <class Rows, class Get>
Band band_of(const Rows& rows, std::size_t state, Get get) {
  Band band;
  for (const auto& row : rows) {
    const PosteriorSummary& s = get(row);
    band.time.push_back(s.time);
    band.mean.push_back(s.mean[state]);
    band.low.push_back(s.q05[state]);
    band.high.push_back(s.q95[state]);
  }
  return band;
}

std::string draw(Picture picture, const FilterContext& c, const FilterRun& run,
                 const std::optional<ObservationPath>& signal) {
  const std::string what =
      fmt::format("{}: {}, {} steps", c.model.name, describe(c.setup), run.statistics.steps);
  if (!run.density.empty()) {
    std::vector<DensityPanel> panels = run.density;
    for (std::size_t i = 0; i < panels.size(); ++i)
      if (const auto curve = signal_of(signal, i)) panels[i].signal = nearest_value(*curve, run.density_time);
    return draw_density(std::move(picture), fmt::format("{}, t = {:g}", what, run.density_time), panels);
  }
  std::vector<PosteriorPanel> panels;
  for (std::size_t i = 0; i < c.model.reported_dimension(); ++i) {
    PosteriorPanel panel{c.model.state_names[i],
                         band_of(
                             run.rows, i, [](const LaunchesSummary& s) -> const auto& { return s.mean; }),
                         {},
                         signal_of(signal, i)};
    if (!run.exact.empty())
      panel.exact = band_of(
          run.exact, i, [](const PosteriorSummary& s) -> const auto& { return s; });
    panels.push_back(std::move(panel));
  }
  return draw_posterior(std::move(picture), what, panels);
}

Table table_of(const FilterContext& c, const FilterRun& run) {
  const bool several = c.setup.launches > 1;
  Table table{filter_columns(c.model, c.setup, c.highest_moment), {}};
  for (const LaunchesSummary& row : run.rows) table.rows.push_back(filter_row(row, several));
  return table;
}

void filter_and_write(const FilterCommandArguments& a) {
  const auto began = std::chrono::steady_clock::now();
  const Model model = load_model(model_file(a.model).string(), a.parameters);
  if (model.observation == ObservationKind::none)
    throw InputError("the model has no [observation]: there is nothing to filter by", "model " + model.name);
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
  const auto windows = open_windows(*a.observations, model, a.steps);

  const int highest_moment = static_cast<int>(a.moments.value_or(0));
  const bool several = setup.launches > 1, csv = a.format.value_or(TableFormat::csv) == TableFormat::csv;
  // Rows go out as they come only where they come one by one; a file appears when it is whole.
  const bool follow = windows->streams() && csv && output.target() == "-";
  FilterRequest request{highest_moment, a.density_at, !a.quiet, {}};
  if (follow) {
    write_to_stdout(csv_header(filter_columns(model, setup, highest_moment)));
    request.observe = [several](const LaunchesSummary& row) {
      write_to_stdout(csv_row(filter_row(row, several)));
    };
  }
  const FilterRun run = run_filter(model, setup, *windows, request);
  const FilterContext context{model, setup, *windows, *a.observations, highest_moment};
  if (!follow)
    output.stage(csv ? to_csv(table_of(context, run))
                     : to_json(filter_report(context, run), table_of(context, run)));
  if (plot) plot->stage(draw(*picture, context, run, signal));
  if (!follow) output.publish();
  if (plot) plot->publish();
  if (a.quiet) return;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  std::fputs(filter_summary(context, run, took.count()).c_str(), stderr);
}

}  // namespace

void add_filter_command(CLI::App& program) {
  CLI::App& app =
      *program.add_subcommand("filter", "The law of the signal given its observations, through time");
  const auto a = std::make_shared<FilterCommandArguments>();
  app.add_option("MODEL", a->model, "A bundled model or a TOML file")->required();
  add_text(app, "--observations", a->observations, "FILE",
           "CSV with header t,y1,..; - is standard input, row by row")
      ->required();
  add_record_steps(app, a->steps);
  add_filter_options(app, a->filter);
  add_assignments(app, a->parameters);
  add_text(app, "--output", a->output, "FILE", "Where the table goes [standard output]");
  add_choice(app, "--format", a->format, formats, "Of the table [csv]");
  add_moments(app, a->moments);
  add_text(app, "--plot", a->plot, "FILE", "A picture of mean and 5-95 % band, .svg or .png");
  add_number(app, "--density-at", a->density_at, Sign::any, "Draw the law at this time instead");
  add_text(app, "--signal", a->signal, "FILE", "The true signal (CSV t,<state>,..), to be drawn as well");
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(
      "Example:\n"
      "  wienertree filter benes --observations Y.csv --signal X.csv --output posterior.csv --plot "
      "posterior.svg");
  app.callback([a] { filter_and_write(*a); });
}

}  // namespace wienertree::app
