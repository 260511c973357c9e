#pragma once
/// A progress bar on a terminal, for what takes longer than a second.
#include <chrono>
#include <cstddef>
#include <string>

namespace wienertree::app {

/// Draws on standard error, at most ten times a second, and clears its line when it goes.
class Progress {
 public:
  /// `enabled` is what the user allows; nothing is drawn where standard error is not a terminal. total = 0:
  /// unknown.
  Progress(std::string label, std::size_t total, bool enabled);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance_to(std::size_t done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  std::size_t total_;
  bool enabled_, drawn_ = false;
  Clock::time_point start_, next_;
};

}  // namespace wienertree::app
