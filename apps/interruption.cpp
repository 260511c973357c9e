#include "interruption.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <exception>

#include "output.hpp"

namespace wienertree::app {
namespace {

std::atomic<bool> deferred{false};
std::atomic<int> noted{0};
// Written by the handler, so that a wait for input which is about to begin ends as well.
std::array<int, 2> wake = {-1, -1};

extern "C" void interrupt(int signal) {
  const int error = errno;
  if (deferred && noted.exchange(signal) == 0) {
    const char byte = 0;
    const ssize_t written = ::write(wake[1], &byte, 1);
    static_cast<void>(written);  // a full pipe wakes as well
    errno = error;
    return;
  }
  remove_temporary_files();
  std::signal(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace

void install_signal_handlers() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
}

DeferredInterruption::DeferredInterruption() {
  if (wake[0] < 0 && ::pipe2(wake.data(), O_CLOEXEC | O_NONBLOCK) != 0) wake = {-1, -1};
  noted = 0;
  deferred = true;
}

DeferredInterruption::~DeferredInterruption() {
  deferred = false;
  // It came after the last step, when nothing was left to be saved.
  if (noted != 0 && std::uncaught_exceptions() == 0) end_by(noted);
}

int noted_interruption() { return noted; }

bool wait_for_input(int descriptor) {
  std::array<pollfd, 2> waiting = {{{descriptor, POLLIN, 0}, {wake[0], POLLIN, 0}}};
  while (noted == 0)
    if (::poll(waiting.data(), wake[0] < 0 ? 1 : 2, -1) > 0 && waiting[0].revents != 0) return noted == 0;
  return false;
}

void end_by(int signal) {
  remove_temporary_files();
  std::signal(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace wienertree::app
