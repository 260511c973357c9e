#pragma once
/// A filter on a recorded observation whose resolution is chosen, and whose error is estimated, by runs of other
/// resolutions.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "wienertree/run/accuracy.hpp"
#include "wienertree/run/launches.hpp"

namespace wienertree {

/// What the control goes by.
struct ControlOptions {
  double tolerance = 0.02;  ///< E, see AnswerError::within
  double work = 4e8;        ///< node-steps (work_of) that the runs together may take: about 45 s of one core
  std::size_t highest_moment = 0;
  std::optional<std::size_t> steps;  ///< given by the user: stays
  bool nodes_given = false;          ///< setup.options.nodes stays
  /// Cubature formulas, for the run of another degree.
  std::filesystem::path formulas;
};

/// What a run is for.
enum class RunRole : std::uint8_t {
  level,   ///< an answer; each level has twice the nodes and steps of the one before, as far as they are free
  steps,   ///< level, but for the number of steps, where steps are given
  nodes,   ///< level, but for half the nodes, where nodes are given
  degree,  ///< level, but for the degree m + 2 of the formula, or m - 2 where there is none
  rows,  ///< level, but with the observed path linear between rows, which is the first order of their spacing
  launch_1,  ///< random methods: a quarter of the particles, other random numbers
  launch_2,
};

/// One run over the whole record, and what it found.
struct FinishedRun {
  RunRole role = RunRole::level;
  int level = 0;
  std::vector<LaunchesSummary> rows;  ///< the start, unless it is observed, then one per output time
  FilterStatistics statistics;
  std::vector<FilterWarning> warnings;
  /// Why it came to no end; empty otherwise.
  std::string failure, failure_where, failure_value;
  bool failed() const { return !failure.empty(); }
  void exchange(StateArchive& archive);
};

/// What was reached.
struct Accuracy {
  RowErrors rows;        ///< one per row of the answer
  AnswerError error;     ///< the largest of each part
  bool known = false;    ///< whether the runs to compare with came to their end
  bool reached = false;  ///< whether the error is within the tolerance
};

/// Level 0 has half the nodes that are recommended for the model and, where they are free, half the steps; the
/// answer is of level L >= 1. Its error is estimated by
///
///     |answer_L - answer_{L-1}| + |steps| + |nodes| + |degree| + |rows|,
///
/// where the last four are the differences that the roles of RunRole make at level L-1, each run only where it
/// applies and once the first term is within the tolerance. Errors fall from level to level, so that the sum
/// exceeds the error of level L. While it is above the tolerance, and the work of the next level is left, L grows.
/// Filters in closed form are run once: their error is that of rounding and of their ODE solver and, for
/// continuous records, the part of the rows.
///
/// Everything is decided by counted work and the numbers found: the same input gives the same bytes anywhere.
class ControlledFilter {
 public:
  /// The model and the rows must outlive it. @throws InputError as make_filter and ObservationWindows
  ControlledFilter(const Model& model, const FilterSetup& setup, const ControlOptions& control,
                   ObservationRows rows);
  ~ControlledFilter();
  ControlledFilter(ControlledFilter&&) noexcept;

  /// One window of the run in progress; false once the answer is there.
  /// @throws RunError as filters do, if no run comes to an end
  bool advance();
  /// Windows taken so far, over all runs.
  std::size_t windows_done() const { return windows_done_; }
  double time() const { return time_; }

  /// @pre advance() returned false
  const FinishedRun& answer() const;
  Accuracy accuracy() const;
  /// The options of the answer.
  FilterSetup answer_setup() const;
  /// The same, and before there is an answer those of level 1.
  FilterSetup chosen_setup() const;
  /// The windows of the answer, to go through it again.
  ObservationWindows answer_windows() const;
  /// Warnings of the answer, then a sentence for an error above the tolerance or unknown; without "warning:".
  std::vector<std::string> warnings() const;
  /// Work of all runs, in node-steps.
  double work() const { return work_; }
  /// All that the rest depends on: the finished runs and the one in progress.
  void exchange(StateArchive& archive);

 private:
  struct Plan;  ///< of one run: its role, options and windows
  struct Run;   ///< the one in progress

  bool is_output(const Plan& plan, const ObservationWindow& window) const;
  Plan plan(RunRole role, int level) const;
  std::optional<Plan> next() const;
  std::optional<Plan> next_guard(int level) const;
  bool applies(RunRole role) const;
  const FinishedRun* find(RunRole role, int level) const;
  int answer_level() const;
  RowErrors difference_of_levels(int level) const;  ///< from the level below; empty where there is none
  RowErrors errors_of(int level) const;
  std::string missing_guard() const;
  bool rows_too_far_apart(int level) const;
  bool affordable(int level) const;
  bool closed_form() const;
  bool alone() const;  ///< whether there is one level only
  std::optional<CubatureFormula> other_formula() const;
  void finish();

  const Model& model_;
  FilterSetup setup_;
  ControlOptions control_;
  ObservationRows rows_;
  std::vector<std::size_t> output_rows_;  ///< of a continuous record
  std::vector<FinishedRun> finished_;
  std::unique_ptr<Run> current_;
  std::size_t windows_done_ = 0;
  double work_ = 0, time_ = 0;
};

}  // namespace wienertree
