#pragma once
/// Standard input as a stream, read as bytes arrive.
#include <array>
#include <streambuf>

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

}  // namespace wienertree::app
