#pragma once
/// A filter with its observations, step by step.
#include <pybind11/pybind11.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "filter_arguments.hpp"
#include "interrupts.hpp"
#include "models.hpp"
#include "wienertree/run/launches.hpp"
#include "wienertree/run/window_source.hpp"

namespace wienertree::python {

/// What was given as keyword arguments.
struct FilterRequested {
  app::FilterArguments filter;
  std::optional<std::uint64_t> steps, moments;
};
void add_session_options(CLI::App& app, FilterRequested& requested);

class FilterSession {
 public:
  /// @throws InputError as for the command line
  FilterSession(const py::object& model, const py::object& observations, py::dict options);
  FilterSession(const FilterSession&) = delete;
  FilterSession& operator=(const FilterSession&) = delete;

  /// Goes to the next law and sums it up: that of the start, unless it is observed, then those at the ends of
  /// the windows; false where there is none, or once it has thrown. Needs no lock of the interpreter.
  bool advance();
  const LaunchesSummary& row() const { return row_; }
  /// @pre advance() was called
  const Posterior& posterior() { return launches_->posterior(); }
  /// Laws so far.
  std::size_t steps() const { return steps_; }
  FilterStatistics statistics() const { return launches_->statistics(); }

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
  std::unique_ptr<WindowSource> windows_;
  std::unique_ptr<Launches> launches_;
  ObservationWindow window_;
  LaunchesSummary row_;
  std::size_t steps_ = 0;
  bool finished_ = false;
  std::atomic<bool> in_use_ = false;
};

}  // namespace wienertree::python
