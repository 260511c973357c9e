#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace wienertree::app {
namespace {

constexpr std::chrono::milliseconds before_first_drawing{1000}, between_drawings{100};
constexpr std::size_t bar_width = 30;

}  // namespace

Progress::Progress(std::string label, std::size_t total, bool enabled)
    : label_(std::move(label)),
      total_(total),
      enabled_(enabled && ::isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      next_(start_ + before_first_drawing) {}

Progress::~Progress() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

void Progress::advance_to(std::size_t done) {
  if (!enabled_) return;
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + between_drawings;
  drawn_ = true;
  std::string line = fmt::format("\r{} ", label_);
  if (total_ > 0) {
    const double part = static_cast<double>(done) / static_cast<double>(total_);
    const auto filled = static_cast<std::size_t>(part * bar_width);
    const double left = std::chrono::duration<double>(now - start_).count() * (1 / part - 1);
    line += fmt::format("[{:=<{}}{: <{}}] {:3.0f} %", "", filled, "", bar_width - filled, 100 * part);
    if (done > 0) line += fmt::format(", {:.0f} s left", std::ceil(left));
  } else {
    line += fmt::format("{} rows", done);
  }
  std::fputs((line + "\033[K").c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace wienertree::app
