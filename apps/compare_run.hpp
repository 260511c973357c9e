#pragma once
/// The evidence of several models through time.
#include <memory>
#include <string>
#include <vector>

#include "filter_arguments.hpp"
#include "saved_run.hpp"
#include "wienertree/run/window_source.hpp"

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
  /// Of model m against the first.
  double log_bayes_factor(std::size_t m) const { return log_evidence[m] - log_evidence[0]; }
  /// Of the models given the observations, if they were equally probable before.
  std::vector<double> probabilities() const;
  void exchange(StateArchive& archive) { archive(time, log_evidence, standard_error); }
};

/// Rows are times that all models step to. Launches of different models use the same seed, but their errors
/// are not taken to cancel.
/// @param windows the same observations for each contender
/// @throws InputError naming the model whose steps end at other times than those of the first; RunError as
/// filters do; Interrupted if a noted interruption ended it,
/// its checkpoint being written
std::vector<ComparisonRow> compare(const std::vector<Contender>& contenders,
                                   const std::vector<std::unique_ptr<WindowSource>>& windows,
                                   bool show_progress, SavedRun& saved);

}  // namespace wienertree::app
