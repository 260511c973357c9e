#pragma once
/// Standard input as a stream, read as bytes arrive.
#include <array>
#include <memory>
#include <optional>
#include <streambuf>
#include <string>

#include "wienertree/run/window_source.hpp"

namespace wienertree::app {

/// Hands on what has arrived without waiting for more. An interruption (interruption.hpp) that is noted while
/// it waits, or a failure to read, leaves the stream bad.
class StandardInput final : public std::streambuf {
 public:
  bool interrupted() const { return interrupted_; }

 protected:
  int_type underflow() override;

 private:
  std::array<char, 65536> buffer_;
  bool interrupted_ = false;
};

/// The windows of --observations: "-" is standard input, where every row ends a window; else a file.
/// @throws InputError as open_windows and follow_windows, and for steps with standard input
std::unique_ptr<WindowSource> windows_of(const std::string& observations, const Model& model,
                                         std::optional<std::size_t> steps, bool resumed = false);

}  // namespace wienertree::app
