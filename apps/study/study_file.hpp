#pragma once
/// The study file: what is swept, against which truth, and what is drawn. docs/studies.md has every key.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "wienertree/study/error_measure.hpp"

namespace wienertree::app {

/// An option of `filter` or `weak` with the values it takes. "set.mu" is `--set mu=..`, "until" the time at
/// which a filter is asked.
struct StudyOption {
  std::string name;
  std::vector<std::string> values;
  std::string where;  ///< file, line and key
};
using StudyOptions = std::vector<StudyOption>;
const StudyOption* find_option(const StudyOptions& options, const std::string& name);

/// Where observations come from; simulated unless there is a file.
struct StudyObservations {
  std::optional<std::string> file, model;  ///< model: of the simulation, the cell's own if none
  double horizon = 1;
  std::size_t steps = 100'000, keep = 10'000, paths = 1;
  std::uint64_t seed = 1;
};

struct StudyReference {
  enum class Kind { none, exact, expression, run };
  Kind kind = Kind::none;
  std::string expression;                                      ///< of the model's parameters
  std::vector<std::pair<std::string, std::string>> by_payoff;  ///< an expression for each payoff
  StudyOptions options;  ///< of the run, in addition to those that state the problem
  std::string where;
};

/// Options that belong together, with the lists that are swept.
struct StudySeries {
  std::string label;
  StudyOptions options;        ///< [options] with those of the series over them
  std::uint32_t launches = 1;  ///< of what draws
  std::string where;
};

struct StudyPlot {
  std::string title;
  bool density = false;  ///< the law itself at the time `until`, a panel a line, instead of an error
  std::string x, along;  ///< axis, and the option that runs along a line
  std::string y, quantity;
  std::string x_label, y_label;
  std::vector<std::string> series;  ///< labels; empty: all
  bool fit = true;
  std::optional<std::pair<double, double>> fit_range;  ///< of x
  std::vector<std::string> unfitted;                   ///< labels of series whose lines have no slope
  bool log_x = true, log_y = true;
  std::string where;
};

/// A sentence that the numbers decide.
struct StudyClaim {
  std::string text;
  bool ratio = false;               ///< of two lines, instead of the slope of one
  std::size_t plot = 0;             ///< whose lines are meant, from 0
  std::string line, to;             ///< labels of lines; `to` only for a ratio
  std::optional<double> at, to_at;  ///< values of `along`; none: the geometric mean over the points of both
  double low = 0, high = 0;
  bool holds = true;  ///< what we find
  std::string where;
};

struct Study {
  std::string name;       ///< of the file, without directory and extension
  std::string directory;  ///< of the file, from which its paths start
  std::string source;
  std::string title, paper, finding;
  bool weak = false;
  bool full = false;
  std::vector<std::string> quantities;
  std::vector<std::pair<std::string, ErrorMeasure>> measures;
  StudyReference reference;
  StudyObservations observations;
  std::vector<std::string> pool;  ///< options whose values are taken together
  std::vector<StudySeries> series;
  std::vector<StudyPlot> plots;
  std::vector<StudyClaim> claims;
};

/// `full`: what stands under [full] replaces the same keys: tables key by key, everything else whole.
/// @throws InputError naming file, line and key
Study read_study(const std::string& path, bool full);

}  // namespace wienertree::app
