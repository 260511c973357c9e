#pragma once
/// The cells of a study: one choice of every option, parsed as the command line would.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "../filter_arguments.hpp"
#include "../weak_outcome.hpp"
#include "study_file.hpp"

namespace wienertree::app {

/// What a study's cell says in words; one value an option.
using CellOptions = std::vector<std::pair<std::string, std::string>>;
/// Empty if the option is not there.
std::string option_of(const CellOptions& options, const std::string& name);

/// A filter with its model, ready to run.
struct FilterCell {
  std::shared_ptr<const Model> model;
  std::string model_file;
  Assignments parameters;
  FilterSetup setup;
  std::optional<std::size_t> steps;
  std::optional<double> until;
  std::string problem;  ///< model, parameters and `until` in words: what the reference depends on
};

struct WeakCell {
  WeakArguments arguments;
  WeakProblem problem;
  std::optional<DrivenFormula> driven;  ///< none where --tolerance chooses it
};

struct StudyCell {
  std::size_t series = 0;
  CellOptions options;
  std::string key;             ///< "benes --steps 10 --functional picard": what names it in tables
  std::string identity;        ///< identity_of_runs: what else decides its runs
  std::uint32_t launches = 1;  ///< 1 where nothing is drawn
  std::shared_ptr<const FilterCell> filter;
  std::shared_ptr<const WeakCell> weak;
};

/// Models that several cells share are loaded once.
class ModelShelf {
 public:
  explicit ModelShelf(std::string directory) : directory_(std::move(directory)) {}
  /// A bundled model, or a file whose path starts from the study's directory. @throws InputError as
  /// load_model
  std::shared_ptr<const Model> get(const std::string& name, const Assignments& parameters);
  std::string file_of(const std::string& name) const;

 private:
  std::string directory_;
  std::vector<std::pair<std::string, std::shared_ptr<const Model>>> models_;
};

/// All cells, in the order of the file, the last list running fastest. Two series may have a cell in common:
/// its runs are those of both.
/// @throws InputError naming file and key for an option that is unknown or has no meaning
std::vector<StudyCell> study_cells(const Study& study, ModelShelf& models);

/// @param options one value each @throws InputError naming `where`
FilterCell parse_filter_cell(const CellOptions& options, ModelShelf& models, const std::string& where);
WeakCell parse_weak_cell(const CellOptions& options, const ModelShelf& models, const std::string& where);

/// One launch. @throws as run_weak
WeakOutcome run_weak_cell(const WeakCell& cell, std::uint32_t launch);
/// NaN if there is none of this name.
double number_named(const NamedNumbers& numbers, const std::string& name);

/// The options with values from `over` in place of, or after, their own.
CellOptions with(CellOptions options, const StudyOptions& over);
std::string words_of(const CellOptions& options);

}  // namespace wienertree::app
