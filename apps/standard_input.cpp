#include "standard_input.hpp"

#include <unistd.h>

#include <cerrno>
#include <istream>
#include <system_error>

#include "interruption.hpp"
#include "run_files.hpp"

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

namespace {

// Standard input as a stream; a member of its own so that it is there before the windows that read it.
struct InputStream {
  StandardInput input;
  std::istream stream{&input};
};

class StandardInputWindows final : InputStream, public WindowSource {
 public:
  StandardInputWindows(const Model& model, bool resumed)
      : windows_(follow_windows(stream, "standard input", model, resumed,
                                [this] { return input.interrupted(); })) {}
  bool next(ObservationWindow& window) override { return windows_->next(window); }
  double start() const override { return windows_->start(); }
  bool observed_at_start() const override { return windows_->observed_at_start(); }
  std::optional<double> end() const override { return windows_->end(); }
  std::size_t size() const override { return windows_->size(); }
  std::size_t rows() const override { return windows_->rows(); }
  bool streams() const override { return windows_->streams(); }
  std::string identity() const override { return windows_->identity(); }
  void exchange(StateArchive& archive) override { windows_->exchange(archive); }

 private:
  std::unique_ptr<WindowSource> windows_;
};

}  // namespace

std::unique_ptr<WindowSource> windows_of(const std::string& observations, const Model& model,
                                         std::optional<std::size_t> steps, bool resumed) {
  note_input("--observations", observations);
  if (observations != "-") return open_windows(observations, model, steps);
  if (steps)
    throw InputError("needs the whole record; with --observations - every row ends a step", "--steps",
                     std::to_string(*steps));
  return std::make_unique<StandardInputWindows>(model, resumed);
}

}  // namespace wienertree::app
