#pragma once
/// A filter with its observations, step by step.
#include <pybind11/pybind11.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "filter_arguments.hpp"
#include "interrupts.hpp"
#include "models.hpp"
#include "wienertree/run/controlled_filter.hpp"
#include "wienertree/run/launches.hpp"
#include "wienertree/run/window_source.hpp"

namespace wienertree::python {

/// What was given as keyword arguments.
struct FilterRequested {
  app::FilterArguments filter;
  app::AccuracyArguments accuracy;
  std::optional<std::uint64_t> steps, moments;
};
void add_session_options(CLI::App& app, FilterRequested& requested);

class FilterSession {
 public:
  /// @throws InputError as for the command line
  FilterSession(const py::object& model, const py::object& observations, py::dict options);
  FilterSession(const FilterSession&) = delete;
  FilterSession& operator=(const FilterSession&) = delete;

  /// One window of the runs that choose the resolution and tell the error; false once they are done. Needs no lock of
  /// the interpreter.
  bool search() { return control_->advance(); }
  /// @pre search() returned false
  const ControlledFilter& control() const { return *control_; }
  /// Goes to the next law and sums it up: that of the start, unless it is observed, then one per row of the table, by
  /// the resolution that was chosen; false where there is none, or once it has thrown. Needs no lock of the interpreter.
  bool advance();
  const LaunchesSummary& row() const { return row_; }
  /// @pre advance() was called
  const Posterior& posterior() { return launches_->posterior(); }
  /// Laws so far.
  std::size_t steps() const { return steps_; }
  FilterStatistics statistics() const {
    return launches_ ? launches_->statistics() : control_->answer().statistics;
  }

  const FilterSetup& setup() const { return setup_; }
  const TextModel& text() const { return model_.text(); }
  std::vector<std::string> states() const;
  py::dict options_in_force() const;

  /// Held while the filter is worked with, since other threads run meanwhile.
  class Use {
   public:
    /// @throws RunError if it is worked with already
    explicit Use(FilterSession& session);
    ~Use() { session_.in_use_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    FilterSession& session_;
  };

 private:
  void read(const py::object& observations, std::optional<std::size_t> steps);

  PyModel model_;
  FilterSetup setup_;
  int highest_moment_ = 0;
  Doubles times_, values_;  ///< keep the memory that windows_ refers to
  std::unique_ptr<WindowSource> source_;
  std::unique_ptr<ControlledFilter> control_;
  std::optional<ObservationWindows> windows_;  ///< of the answer
  std::size_t next_ = 0;                       ///< of these
  std::unique_ptr<Launches> launches_;
  ObservationWindow window_;
  LaunchesSummary row_;
  std::size_t steps_ = 0;
  bool finished_ = false;
  std::atomic<bool> in_use_ = false;
};

}  // namespace wienertree::python
