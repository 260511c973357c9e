#pragma once
/// The evidence of several models through time.
#include <string>
#include <vector>

#include "filter_arguments.hpp"
#include "saved_run.hpp"
#include "wienertree/run/controlled_filter.hpp"

namespace wienertree::app {

struct Contender {
  std::string label;  ///< as given on the command line
  std::string file;   ///< the model's name or path, without parameters
  Model model;
  FilterSetup setup;
};

/// The end of one step.
struct ComparisonRow {
  double time = 0;
  std::vector<double> log_evidence;    ///< one a model: of the average over the launches
  std::vector<double> standard_error;  ///< of log_evidence, from the spread of the launches; 0 for one launch
  std::vector<double> error;           ///< estimate of the error of log_evidence
  /// Of model m against the first.
  double log_bayes_factor(std::size_t m) const { return log_evidence[m] - log_evidence[0]; }
  /// Of the models given the observations, if they were equally probable before.
  std::vector<double> probabilities() const;
  void exchange(StateArchive& archive) { archive(time, log_evidence, standard_error, error); }
};

struct Comparison {
  std::vector<ComparisonRow> rows;
  std::vector<FilterSetup> setup;                  ///< of each answer
  std::vector<std::vector<std::string>> warnings;  ///< of each model, a sentence each
  std::vector<double> error;  ///< of each log evidence at the end; infinite where it is not known
  /// Whether the errors of two models together are as large as the difference of their log evidences, so that the
  /// comparison says nothing of these two.
  bool undecided(std::size_t first, std::size_t second) const;
};

/// Each model is filtered to the tolerance by itself. Rows are times that all models tell of. Launches of different
/// models use the same seed, but their errors are not taken to cancel.
/// @throws InputError naming the model whose rows are at other times than those of the first; RunError as filters do;
/// Interrupted if a noted interruption ended it, its checkpoint being written
Comparison compare(const std::vector<Contender>& contenders, const ControlOptions& control,
                   const std::vector<ObservationRows>& records, bool show_progress, SavedRun& saved);

}  // namespace wienertree::app
