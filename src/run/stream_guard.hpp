#pragma once
/// A filter that follows a stream, with others of less resolution beside it that tell its error.
#include <memory>
#include <string>
#include <vector>

#include "wienertree/run/controlled_filter.hpp"

namespace wienertree {

/// A stream cannot be gone through twice, so that the resolution is fixed: that of the options. Beside it go one filter
/// of half the nodes with twice the substep tolerance and one of these with another degree of the formula; of random
/// methods, two of a quarter of the particles. What they differ from the answer and from each other, by the sums of
/// ControlledFilter, is the estimate of error of each row. Filters in closed form go alone.
class StreamGuard {
 public:
  /// @throws InputError as make_filter
  StreamGuard(const Model& model, const FilterSetup& setup, const ControlOptions& control);
  void advance(const ObservationWindow& window);
  /// The row at `time`, and the estimate of its error.
  AnswerError summarise(double time, int highest_moment, LaunchesSummary& out);
  const Posterior& posterior() { return answer_.posterior(); }
  FilterStatistics statistics() const { return answer_.statistics(); }
  /// The largest so far.
  const AnswerError& error() const { return error_; }
  bool error_known() const { return closed_form_ || !guards_.empty(); }
  /// A sentence each.
  std::vector<std::string> warnings() const;
  void exchange(StateArchive& archive);

 private:
  ControlOptions control_;
  Launches answer_;
  std::vector<Launches> guards_;
  bool random_, closed_form_;
  AnswerError error_;
};

}  // namespace wienertree
