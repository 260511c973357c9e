#include "wienertree/run/window_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <limits>
#include <vector>

#include "wienertree/run/checksum.hpp"

namespace wienertree {
namespace {

class RecordedWindows final : public WindowSource {
 public:
  RecordedWindows(ObservationRows rows, const Model& model, std::optional<std::size_t> steps,
                  std::unique_ptr<const ObservationPath> owned = nullptr)
      : owned_(std::move(owned)),
        rows_(rows),
        windows_(rows_, model.observation, model.timing,
                 steps.value_or(default_steps(rows_, model.observation)), model.jumps()) {
    if (model.inputs) model.inputs->require_span(windows_.start(), windows_.end(), "the observations");
  }

  bool next(ObservationWindow& window) override {
    if (done_ == windows_.size()) return false;
    windows_.get(done_++, window);
    return true;
  }
  double start() const override { return windows_.start(); }
  bool observed_at_start() const override {
    return windows_.size() > 0 && windows_.time(0) == windows_.start();
  }
  std::optional<double> end() const override { return windows_.end(); }
  std::size_t size() const override { return windows_.size(); }
  std::size_t rows() const override { return rows_.rows(); }
  bool streams() const override { return false; }
  std::optional<ObservationRows> record() const override { return rows_; }
  std::string identity() const override {
    const auto bytes = [](std::span<const double> numbers) {
      return std::string_view(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
    };
    return fmt::format("{} rows in {} steps, checksum {} {}", rows_.rows(), windows_.size(),
                       checksum_text(bytes(rows_.times)), checksum_text(bytes(rows_.values)));
  }
  void exchange(StateArchive& archive) override {
    archive(done_);
    StateArchive::require(done_ <= windows_.size());
  }

 private:
  std::unique_ptr<const ObservationPath> owned_;
  ObservationRows rows_;
  ObservationWindows windows_;
  std::size_t done_ = 0;
};

class StreamedWindows final : public WindowSource {
 public:
  StreamedWindows(std::istream& in, const std::string& origin, const Model& model, bool resumed,
                  std::function<bool()> interrupted)
      : kind_(model.observation),
        timing_(model.timing),
        origin_(origin),
        interrupted_(std::move(interrupted)),
        inputs_(model.inputs),
        reader_(in, origin, observation_columns(model.observation_dimension()), model.observation,
                skips_inputs(model)),
        value_(model.observation_dimension()) {
    if (resumed) return;
    if (!read_row()) throw InputError("no rows after the header", origin_);
    start_ = time_;
    pair_.dimension = value_.size();
    pair_.append(time_, value_);
    if (kind_ == ObservationKind::discrete)
      observed_at_start_ = ObservationWindows(pair_, kind_, timing_, 0).size() > 0;
  }

  bool next(ObservationWindow& window) override {
    if (steps_ == 0 && observed_at_start_) return get(window);
    if (!read_row()) {
      if (rows_ == 1 && kind_ == ObservationKind::continuous && !interrupted_())
        throw InputError("a continuous observation needs at least two rows", origin_);
      return false;
    }
    if (pair_.rows() == 2) {
      pair_.times.erase(pair_.times.begin());
      pair_.values.erase(pair_.values.begin(),
                         pair_.values.begin() + static_cast<std::ptrdiff_t>(value_.size()));
    }
    // The row before has been weighed by: as the start of this pair its discrete observation is missing.
    if (kind_ == ObservationKind::discrete)
      std::fill(pair_.values.begin(), pair_.values.end(), std::numeric_limits<double>::quiet_NaN());
    pair_.append(time_, value_);
    return get(window);
  }
  double start() const override { return start_; }
  bool observed_at_start() const override { return observed_at_start_; }
  std::optional<double> end() const override { return {}; }
  std::size_t size() const override { return 0; }
  std::size_t rows() const override { return rows_; }
  bool streams() const override { return true; }
  std::string identity() const override { return origin_; }
  void exchange(StateArchive& archive) override {
    archive(pair_.times, pair_.values, time_, start_, rows_, steps_, observed_at_start_);
    pair_.dimension = value_.size();
    StateArchive::require(!pair_.times.empty() && pair_.values.size() == pair_.rows() * value_.size());
  }

 private:
  // A row after the last one; false at the end of the stream, or when interrupted.
  bool read_row() {
    const double last = rows_ > 0 ? time_ : -std::numeric_limits<double>::infinity();
    double time = 0;
    try {
      do {
        if (!reader_.next(time, value_)) return false;
      } while (!(time > last));
    } catch (const InputError&) {
      if (!interrupted_()) throw;
      return false;
    }
    time_ = time;
    if (inputs_) inputs_->require_span(time, time, "the observations");
    ++rows_;
    return true;
  }
  bool get(ObservationWindow& window) {
    ObservationWindows(pair_, kind_, timing_, 0).get(0, window);
    window.step = ++steps_;
    return true;
  }

  ObservationKind kind_;
  ObservationTiming timing_;
  std::string origin_;
  std::function<bool()> interrupted_;
  std::shared_ptr<const InputFunctions> inputs_;
  ObservationReader reader_;
  std::vector<double> value_;
  ObservationPath pair_;
  double time_ = 0, start_ = 0;
  std::size_t rows_ = 0, steps_ = 0;
  bool observed_at_start_ = false;
};

}  // namespace

// Continuous: a step a row, or fewer where rows abound. Discrete: a step a row, or several where rows are
// few.
std::size_t default_steps(const ObservationRows& rows, ObservationKind kind) {
  const std::size_t gaps = rows.rows() - 1;
  if (kind == ObservationKind::continuous) return std::min(gaps, usual_steps);
  return gaps * std::max<std::size_t>(1, gaps == 0 ? 1 : (usual_steps + gaps / 2) / gaps);
}

std::unique_ptr<WindowSource> open_windows(const std::string& file, const Model& model,
                                           std::optional<std::size_t> steps) {
  auto path = std::make_unique<const ObservationPath>(read_observations(file, model));
  const ObservationRows rows = *path;
  return std::make_unique<RecordedWindows>(rows, model, steps, std::move(path));
}

std::unique_ptr<WindowSource> cut_windows(ObservationRows rows, const Model& model,
                                          std::optional<std::size_t> steps) {
  return std::make_unique<RecordedWindows>(rows, model, steps);
}

std::unique_ptr<WindowSource> follow_windows(std::istream& in, const std::string& origin, const Model& model,
                                             bool resumed, std::function<bool()> interrupted) {
  if (!model.jumps().empty())
    throw InputError(
        "a stream is filtered row by row, and inputs jump between its rows: give the observations as a file",
        origin, fmt::format("t = {}", model.jumps().front()));
  return std::make_unique<StreamedWindows>(in, origin, model, resumed, std::move(interrupted));
}

}  // namespace wienertree
