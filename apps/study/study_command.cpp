#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <thread>

#include "../command_line.hpp"
#include "../commands.hpp"
#include "../data_directory.hpp"
#include "../density_plot.hpp"
#include "../output.hpp"
#include "../table.hpp"
#include "study_directory.hpp"
#include "study_identity.hpp"
#include "study_page.hpp"
#include "study_plot.hpp"

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

// The files of a study, opened before anything is computed.
class StudyFiles {
 public:
  StudyFiles(const fs::path& directory, const std::vector<std::string>& names) {
    for (const std::string& name : names)
      files_.emplace(name, std::make_unique<OutputFile>("--output", (directory / name).string()));
  }
  void write(const std::string& name, std::string content) {
    OutputFile& file = *files_.at(name);
    file.stage(std::move(content));
    file.publish();
  }

 private:
  std::map<std::string, std::unique_ptr<OutputFile>> files_;
};

constexpr const char* journal_name = "runs.csv";

std::string picture_name(std::size_t plot, const char* ending) {
  return fmt::format("plot-{}{}", plot + 1, ending);
}

// All but the journal.
std::vector<std::string> names_of_files(const Study& study) {
  std::vector<std::string> names = {"table.csv", "slopes.csv", "index.html"};
  if (!study.claims.empty()) names.emplace_back("claims.csv");
  for (std::size_t p = 0; p < study.plots.size(); ++p)
    for (const char* ending : {".svg", ".png"}) names.push_back(picture_name(p, ending));
  return names;
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
  for (const std::string& note : results.notes) text += fmt::format("  note: {}\n", note);
  return text + fmt::format("  {}\n", page.string());
}

void study_and_write(const StudyArguments& a) {
  const Study study = read_study(study_file(a.study).string(), a.full);
  ModelShelf models(study.directory);
  std::vector<StudyCell> cells = study_cells(study, models);
  StudyData data(study, cells, models);
  for (StudyCell& cell : cells) cell.identity = identity_of_runs(study, cell, data, models);
  if (!study.plots.empty()) Picture("plot.svg");  // is there a gnuplot?
  rehearse_results(study, cells, data);
  const std::vector<std::string> names = names_of_files(study);
  std::vector<std::string> with_journal = names;
  with_journal.emplace_back(journal_name);
  const StudyDirectory claimed(*a.output, study.name, with_journal);
  const fs::path& directory = claimed.path();
  StudyJournal journal(directory.string(), study.quantities);
  StudyFiles files(directory, names);
  const std::size_t before = journal.records().size();
  const std::size_t threads = a.threads.value_or(std::max(1U, std::thread::hardware_concurrency()));
  const std::vector<RunRecord> runs = run_study(study, cells, data, journal, threads, !a.quiet);
  const std::size_t computed = journal.records().size() - before;
  const StudyResults results = study_results(study, cells, runs);

  std::vector<StudyDownload> downloads = {{"table.csv", points_table(study, results)},
                                          {"slopes.csv", slopes_table(study, results)}};
  if (!study.claims.empty()) downloads.push_back({"claims.csv", claims_table(study, results)});
  for (const StudyDownload& download : downloads) files.write(download.name, download.content);
  std::vector<StudyPicture> pictures;
  for (std::size_t p = 0; p < study.plots.size(); ++p) {
    StudyPicture picture;
    picture.png = picture_name(p, ".png");
    picture.wide = draw(study, p, cells, results, data, "plot.svg", PlotShape::wide);
    picture.narrow = draw(study, p, cells, results, data, "plot.svg", PlotShape::narrow);
    files.write(picture_name(p, ".svg"), picture.wide);
    files.write(picture.png, draw(study, p, cells, results, data, "plot.png", PlotShape::wide));
    pictures.push_back(std::move(picture));
  }
  const std::string all_runs = contents_of(directory / journal_name);
  constexpr std::size_t most_embedded = 1'000'000;
  downloads.push_back({journal_name, all_runs, all_runs.size() <= most_embedded});
  files.write("index.html", study_page(study, results, pictures, downloads));
  if (!a.quiet) tell(summary_of(study, results, computed, runs.size(), fs::path(*a.output) / "index.html"));
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
