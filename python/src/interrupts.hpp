#pragma once
/// Ctrl-C while the interpreter's lock is released.
#include <pybind11/pybind11.h>

#include <chrono>

namespace wienertree::python {

/// Signals are looked for between steps, at most every 20 ms: taking the lock costs more than a short step.
class Interrupts {
 public:
  /// To be called without the lock. @throws pybind11::error_already_set, KeyboardInterrupt as a rule
  void check() {
    const auto now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(20);
    const pybind11::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_ = Clock::now();
};

}  // namespace wienertree::python
