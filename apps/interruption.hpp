#pragma once
/// SIGINT and SIGTERM: at once by default, or between steps for a run that has something to save.
#include <stdexcept>
#include <string>

namespace wienertree::app {

/// A run was asked to stop, and has saved where it was.
class Interrupted : public std::runtime_error {
 public:
  Interrupted(const std::string& message, int signal) : std::runtime_error(message), signal_(signal) {}
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Temporary files of a program ended by SIGINT or SIGTERM are removed; SIGPIPE and SIGXFSZ become errors of
/// the write.
void install_signal_handlers();

/// While such an object lives, the first SIGINT or SIGTERM is only noted; a second one ends the program.
class DeferredInterruption {
 public:
  DeferredInterruption();
  ~DeferredInterruption();
  DeferredInterruption(const DeferredInterruption&) = delete;
  DeferredInterruption& operator=(const DeferredInterruption&) = delete;
};

/// The signal that was noted, or 0.
int noted_interruption();
/// Waits until the descriptor can be read. @returns false if an interruption was noted instead
bool wait_for_input(int descriptor);
/// Ends the program by the signal, as if it had not been caught.
void end_by(int signal);

}  // namespace wienertree::app
