#pragma once
/// A run saved in a file, from which it goes on to the same bytes.
///
/// The file: the line "wienertree checkpoint 1" (the format's version), a line of JSON that says which run it
/// is, the state as bytes, and the CRC-64 of all before it in eight bytes, the lowest first.
#include <chrono>
#include <string>
#include <string_view>

#include "output.hpp"
#include "table.hpp"

namespace wienertree::app {

/// Replaces its file now and then, each time by a whole one.
class Checkpoint {
 public:
  /// `run` says which run it is. @throws InputError if nothing could be written there
  Checkpoint(const std::string& file, double seconds_between, Json run);
  /// Whether the time has come: not before 50 times what the last one took, so that it costs 2 % at most.
  bool due() const;
  /// @throws RunError if it cannot be written; the one before is there still
  void write(std::string_view state);
  const std::string& file() const { return file_.target(); }

 private:
  using Clock = std::chrono::steady_clock;
  OutputFile file_;
  std::chrono::duration<double> between_;
  Clock::time_point next_;
  std::string opening_;
};

/// The state of a checkpoint of this run.
/// @throws InputError if the file cannot be read, is no checkpoint, is damaged or of another format, or is
/// that of another run: naming the first thing that differs, and both values
std::string read_checkpoint(const std::string& file, const Json& run);

}  // namespace wienertree::app
