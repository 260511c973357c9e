#pragma once
/// What the runs of a study say: errors with intervals, lines with slopes, claims decided.
#include <optional>
#include <string>
#include <vector>

#include "study_runner.hpp"
#include "wienertree/study/error_measure.hpp"
#include "wienertree/study/slope.hpp"

namespace wienertree::app {

/// All runs of one choice of options, those of [pool] taken together.
struct StudyPoint {
  std::size_t series = 0;
  CellOptions options;
  std::vector<MeasuredError> errors;  ///< quantity by quantity, measure by measure
  std::size_t runs = 0;
  double nodes = 0, ode_solves = 0, seconds = 0;  ///< of one run, on average
};

struct LinePoint {
  double x = 0, along = 0;
  MeasuredError y;
};

struct PlotLine {
  std::string label;
  std::vector<LinePoint> points;  ///< along the line
  std::optional<SlopeFit> fit;
};

struct ClaimOutcome {
  double value = 0;
  double low = 0, high = 0;  ///< confidence interval of a slope; NaN for a ratio
  bool inside = false;       ///< of what the claim says
};

struct StudyResults {
  std::vector<StudyPoint> points;
  std::vector<std::vector<PlotLine>> lines;  ///< one list a plot; empty for a density
  std::vector<ClaimOutcome> claims;
  std::vector<std::string> notes;  ///< what is left out, and why
};

/// Goes through tables, lines and claims with made-up numbers, before anything is computed.
/// @throws InputError for an axis that is no number in a cell, or not positive and logarithmic; a line that no plot
/// has; a claim that no line decides; a measure that applies to no series; a plot without lines
void rehearse_results(const Study& study, const std::vector<StudyCell>& cells, const StudyData& data);

/// A series to which a measure does not apply (a deviation over launches where nothing is drawn) has no number
/// there, and a note says so; the same holds for points that have no place on a logarithmic axis. A claim that the
/// numbers leave undecided does not hold.
StudyResults study_results(const Study& study, const std::vector<StudyCell>& cells,
                           const std::vector<RunRecord>& records);

/// CSV: a row a point.
std::string points_table(const Study& study, const StudyResults& results);
/// CSV: plot, line, slope with its interval, points.
std::string slopes_table(const Study& study, const StudyResults& results);
/// CSV: claim, value, interval, what is claimed, whether it holds, whether that is what the study says.
std::string claims_table(const Study& study, const StudyResults& results);

}  // namespace wienertree::app
