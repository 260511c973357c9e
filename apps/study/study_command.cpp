#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <system_error>
#include <thread>

#include "../command_line.hpp"
#include "../commands.hpp"
#include "../data_directory.hpp"
#include "../density_plot.hpp"
#include "../output.hpp"
#include "../table.hpp"
#include "study_page.hpp"
#include "study_plot.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  std::string study;
  std::optional<std::string> output;
  std::optional<std::uint64_t> threads;
  bool full = false, quiet = false;
};

std::string contents_of(const fs::path& file) {
  std::ostringstream all;
  all << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(all).str();
}

void write_file(const fs::path& file, std::string content) {
  OutputFile output("--output", file.string());
  output.stage(std::move(content));
  output.publish();
}

// FNV-1a, to see whether a file is still the same.
std::string fingerprint(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return fmt::format("{:016x}", hash);
}

// Everything but the options that decides what a run of this study gives.
Json problem_of(const Study& study, const std::vector<StudyCell>& cells, const ModelShelf& models) {
  Json problem;
  problem["version"] = WIENERTREE_VERSION;
  problem["command"] = study.weak ? "weak" : "filter";
  const StudyReference& r = study.reference;
  problem["reference"] = fmt::format("{} {}", static_cast<int>(r.kind), r.expression);
  for (const StudyOption& option : r.options) problem["reference run"][option.name] = option.values;
  for (const auto& [payoff, value] : r.by_payoff) problem["reference by payoff"][payoff] = value;
  const auto add_file = [&](const std::string& name, const fs::path& file) {
    problem["files"][name] = fingerprint(contents_of(file));
  };
  const StudyObservations& o = study.observations;
  if (o.file)
    add_file(*o.file, study.directory.empty() ? fs::path(*o.file) : fs::path(study.directory) / *o.file);
  else if (!study.weak)
    problem["observations"] = {{"model", o.model.value_or("")},
                               {"horizon", o.horizon},
                               {"steps", o.steps},
                               {"keep", o.keep},
                               {"seed", o.seed}};
  const auto add_model = [&](const std::string& name) { add_file(name, model_file(models.file_of(name))); };
  if (o.model) add_model(*o.model);
  for (const StudyCell& cell : cells) add_model(option_of(cell.options, "model"));
  return problem;
}

// A directory belongs to one problem: runs of another would be taken for this one's. Sweeps may grow.
void claim_directory(const fs::path& directory, const Json& problem) {
  const fs::path file = directory / "problem.json";
  Json all = problem;
  if (fs::exists(file)) {
    const Json before = Json::parse(contents_of(file), nullptr, false);
    if (!before.is_object()) throw InputError("is not what a study left there", "--output", file.string());
    for (const auto& [key, value] : problem.items()) {
      if (key != "files" && before.value(key, Json()) != value)
        throw InputError(
            "holds runs of another study or version (" + key + " differs): give another directory",
            "--output", directory.string());
    }
    const Json files = before.value("files", Json::object());
    for (const auto& [name, print] : files.items()) {
      if (problem["files"].contains(name) && problem["files"][name] != print)
        throw InputError("holds runs from before this file was changed: give another directory",
                         "--output " + directory.string(), name);
      all["files"][name] = print;
    }
    if (all == before) return;
  }
  write_file(file, all.dump(2) + '\n');
}

// The laws themselves: a panel a cell, of the first launch on the first path.
std::vector<DensityPanel> density_panels_of(const Study& study, const StudyPlot& plot,
                                            const std::vector<StudyCell>& cells, StudyData& data) {
  std::vector<DensityPanel> panels;
  for (const StudyCell& cell : cells) {
    const std::string& series = study.series[cell.series].label;
    if (!plot.series.empty() &&
        std::find(plot.series.begin(), plot.series.end(), series) == plot.series.end())
      continue;
    if (!cell.filter) throw InputError("a density is that of a filter", plot.where);
    const StudyTruth& truth = data.truth(cell, 0);
    const auto filter = make_filter(*cell.filter->model, cell.filter->setup.options);
    run_until(*filter, data.windows(*cell.filter, data.observations(cell, 0)), cell.filter->until);
    std::optional<Posterior> exact;
    if (truth.posterior) exact = truth.posterior->view();
    panels.push_back(density_panels({cell.filter->model->state_names.front()}, filter->posterior(),
                                    exact ? &*exact : nullptr, nullptr, RugOf::all_nodes)
                         .front());
    panels.back().title = series.empty() ? cell.key : series;
  }
  return panels;
}

std::string draw(const Study& study, std::size_t p, const std::vector<StudyCell>& cells,
                 const StudyResults& results, StudyData& data, const std::string& file, PlotShape shape) {
  const StudyPlot& plot = study.plots[p];
  if (!plot.density) return draw_study_plot(Picture(file), plot, results.lines[p], shape);
  return draw_density(Picture(file), plot.title, density_panels_of(study, plot, cells, data),
                      shape == PlotShape::wide ? 860 : 400);
}

std::string summary_of(const Study& study, const StudyResults& results, std::size_t computed, std::size_t all,
                       const fs::path& page) {
  std::string text = fmt::format("{}\n  {} runs, {} of them computed now\n", study.title, all, computed);
  for (std::size_t p = 0; p < study.plots.size(); ++p)
    for (const PlotLine& line : results.lines[p])
      if (line.fit)
        text += fmt::format("  plot {}  {:<44} slope {}\n", p + 1, line.label, slope_text(*line.fit));
  for (std::size_t c = 0; c < study.claims.size(); ++c) {
    const ClaimOutcome& o = results.claims[c];
    text += fmt::format(
        "  {} {:.3g} in [{:g}, {:g}]{}: {}\n", o.inside ? "holds:        " : "does not hold:", o.value,
        study.claims[c].low, study.claims[c].high,
        o.inside == study.claims[c].holds ? "" : ", which the study says otherwise", study.claims[c].text);
  }
  return text + fmt::format("  {}\n", page.string());
}

void study_and_write(const StudyArguments& a) {
  const Study study = read_study(study_file(a.study).string(), a.full);
  ModelShelf models(study.directory);
  const std::vector<StudyCell> cells = study_cells(study, models);
  StudyData data(study, cells, models);
  if (!study.plots.empty()) Picture("plot.svg");  // before anything is computed: is there a gnuplot?
  const fs::path directory = *a.output;
  std::error_code failure;
  fs::create_directories(directory, failure);
  if (failure || !fs::is_directory(directory))
    throw InputError("no directory can be made there", "--output", *a.output);
  StudyJournal journal(directory.string(), study.quantities);
  claim_directory(directory, problem_of(study, cells, models));
  const std::size_t before = journal.records().size();
  const std::size_t threads = a.threads.value_or(std::max(1U, std::thread::hardware_concurrency()));
  const std::vector<RunRecord> runs = run_study(study, cells, data, journal, threads, !a.quiet);
  const std::size_t computed = journal.records().size() - before;
  const StudyResults results = study_results(study, cells, runs);

  std::vector<StudyDownload> downloads = {{"table.csv", points_table(study, results)},
                                          {"slopes.csv", slopes_table(study, results)}};
  if (!study.claims.empty()) downloads.push_back({"claims.csv", claims_table(study, results)});
  for (const StudyDownload& download : downloads) write_file(directory / download.name, download.content);
  std::vector<StudyPicture> pictures;
  for (std::size_t p = 0; p < study.plots.size(); ++p) {
    StudyPicture picture;
    const std::string name = fmt::format("plot-{}", p + 1);
    picture.png = name + ".png";
    picture.wide = draw(study, p, cells, results, data, "plot.svg", PlotShape::wide);
    picture.narrow = draw(study, p, cells, results, data, "plot.svg", PlotShape::narrow);
    write_file(directory / (name + ".svg"), picture.wide);
    write_file(directory / picture.png, draw(study, p, cells, results, data, "plot.png", PlotShape::wide));
    pictures.push_back(std::move(picture));
  }
  const std::string all_runs = contents_of(directory / "runs.csv");
  constexpr std::size_t most_embedded = 1'000'000;
  downloads.push_back({"runs.csv", all_runs, all_runs.size() <= most_embedded});
  write_file(directory / "index.html", study_page(study, results, pictures, downloads));
  if (!a.quiet)
    std::fputs(summary_of(study, results, computed, runs.size(), directory / "index.html").c_str(), stderr);
}

std::string bundled_studies() {
  std::string text = "Example:\n  wienertree study steps --output out/steps\nBundled studies:";
  for (const std::string& name : bundled_names("studies", ".toml")) text += "\n  " + name;
  return text;
}

}  // namespace

void add_study_command(CLI::App& program) {
  CLI::App& app =
      *program.add_subcommand("study", "Sweeps over options against a truth: table, slopes, plots, one page");
  const auto a = std::make_shared<StudyArguments>();
  app.add_option("STUDY", a->study, "A bundled study or a TOML file")->required();
  add_text(app, "--output", a->output, "DIR", "Where it goes; what a killed study left there is taken up")
      ->required();
  app.add_flag("--full", a->full, "In the size of the publication");
  add_count(app, "--threads", a->threads, 1, "Threads, a run each; results do not depend on them [all]",
            1024);
  add_memory_limit(app);
  app.add_flag("--quiet", a->quiet, "No summary and no progress bar");
  app.footer(bundled_studies);
  app.callback([a] { study_and_write(*a); });
}

}  // namespace wienertree::app
