#include "standard_input.hpp"

#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "interruption.hpp"

namespace wienertree::app {

// What is thrown here is what marks the stream as bad.
StandardInput::int_type StandardInput::underflow() {
  for (;;) {
    interrupted_ = !wait_for_input(STDIN_FILENO);
    if (interrupted_) throw std::system_error(EINTR, std::generic_category());
    const ssize_t size = ::read(STDIN_FILENO, buffer_.data(), buffer_.size());
    if (size < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (size < 0) throw std::system_error(errno, std::generic_category());
    if (size == 0) return traits_type::eof();
    setg(buffer_.data(), buffer_.data(), buffer_.data() + size);
    return traits_type::to_int_type(buffer_[0]);
  }
}

}  // namespace wienertree::app
