#pragma once
/// The evidence of several models through time.
#include <optional>
#include <string>
#include <vector>

#include "filter_arguments.hpp"

namespace wienertree::app {

struct Contender {
  std::string label;  ///< as given on the command line
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
};

/// Rows are times that all models step to. Launches of different models use the same seed, but their errors
/// are not taken to cancel.
/// @throws InputError, RunError as filters do, naming the model
std::vector<ComparisonRow> compare(const std::vector<Contender>& contenders, const std::string& observations,
                                   std::optional<std::size_t> steps, bool show_progress);

}  // namespace wienertree::app
