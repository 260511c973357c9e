#include "gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "wienertree/numeric/error.hpp"

extern char** environ;

namespace wienertree::app {
namespace {

std::string program_on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::string rest = path == nullptr ? "/usr/bin:/bin" : path;
  while (!rest.empty()) {
    const std::size_t colon = rest.find(':');
    const std::string candidate = rest.substr(0, colon) + "/" + name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  return {};
}

// A file in memory: what a child reads or writes without a pipe that could block.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : file_(::memfd_create(name, MFD_CLOEXEC)) {
    if (file_ < 0) throw RunError("no memory file: " + std::generic_category().message(errno), "plot");
  }
  ~MemoryFile() { ::close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return file_; }

  void fill(std::string_view content) const {
    std::size_t done = 0;
    while (done < content.size()) {
      const ssize_t n = ::write(file_, content.data() + done, content.size() - done);
      if (n < 0) throw RunError("no memory: " + std::generic_category().message(errno), "plot");
      done += static_cast<std::size_t>(n);
    }
    ::lseek(file_, 0, SEEK_SET);
  }
  std::string content() const {
    std::string all;
    std::array<char, 65536> buffer{};
    ::lseek(file_, 0, SEEK_SET);
    for (ssize_t n = 0; (n = ::read(file_, buffer.data(), buffer.size())) > 0;)
      all.append(buffer.data(), static_cast<std::size_t>(n));
    return all;
  }

 private:
  int file_;
};

std::string first_line_of(const std::string& text) {
  std::string line;
  std::size_t begin = 0;
  // gnuplot repeats the command above its complaint, which comes as "line 7: undefined variable: x".
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    line = text.substr(begin, end - begin);
    if (line.find("line ") != std::string::npos) return line;
    begin = end + 1;
  }
  return line;
}

}  // namespace

Picture::Picture(const std::string& file) : file_(file) {
  vector_graphics_ = file.ends_with(".svg");
  if (!vector_graphics_ && !file.ends_with(".png"))
    throw InputError("the file of a plot must end in .svg or .png", "--plot", file);
  program_ = program_on_path("gnuplot");
  if (program_.empty())
    throw InputError(
        "plots need the program gnuplot, which is not on the PATH (Debian: apt install gnuplot-nox)",
        "--plot", file);
}

void Picture::begin(int width, int height) {
  if (vector_graphics_)
    add(fmt::format(
        "set terminal svg size {},{} font \"Helvetica,14\" enhanced background rgb \"white\" linewidth 1",
        width, height));
  else
    add(fmt::format("set terminal pngcairo size {},{} font \"Sans,12\" fontscale 1.9 enhanced linewidth 2",
                    2 * width, 2 * height));
  add("set encoding utf8\nset minussign\nset border 3 lw 0.8 lc rgb \"#444444\"\nset tics nomirror out scale "
      "0.6\nunset "
      "key");
}

void Picture::add_data(const std::string& name, std::span<const std::vector<double>> columns) {
  script_ += fmt::format("${} << END_OF_DATA\n", name);
  const std::size_t rows = columns.empty() ? 0 : columns.front().size();
  for (std::size_t r = 0; r < rows; ++r) {
    for (const std::vector<double>& column : columns)
      fmt::format_to(std::back_inserter(script_), "{:.9g} ", column[r]);
    script_ += '\n';
  }
  script_ += "END_OF_DATA\n";
}

std::string Picture::draw() const {
  const MemoryFile script("script"), picture("picture"), complaint("complaint");
  script.fill(script_);
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, script.descriptor(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, picture.descriptor(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, complaint.descriptor(), STDERR_FILENO);
  // -d: the user's own start-up file does not change the picture.
  std::array<std::string, 2> words = {program_, "-d"};
  std::array<char*, 3> arguments = {words[0].data(), words[1].data(), nullptr};
  pid_t child = 0;
  const int error = ::posix_spawn(&child, program_.c_str(), &files, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  if (error != 0)
    throw RunError("gnuplot cannot be run: " + std::generic_category().message(error), "plot", file_);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  std::string bytes = picture.content();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || bytes.empty())
    throw RunError("gnuplot failed: " + first_line_of(complaint.content()), "plot", file_);
  return bytes;
}

std::string in_quotes(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + '"';
}

std::string name_of_height(const std::string& text, double x) {
  return fmt::format("set label {} at screen {:.4f}, graph 0.5 center rotate by 90 noenhanced",
                     in_quotes(text), x);
}

std::string name_of_width(const std::string& text, double y) {
  return fmt::format("set label {} at graph 0.5, screen {:.4f} center noenhanced", in_quotes(text), y);
}

std::string labels_at_right(std::vector<SideLabel> labels, double spacing) {
  std::stable_sort(labels.begin(), labels.end(), [](const auto& a, const auto& b) { return a.y > b.y; });
  double ceiling = 1;
  for (SideLabel& label : labels) {
    label.y = std::min(label.y, ceiling);
    ceiling = label.y - spacing;
  }
  double floor = 0;
  for (auto label = labels.rbegin(); label != labels.rend(); ++label) {
    label->y = std::max(label->y, floor);
    floor = label->y + spacing;
  }
  std::string commands;
  for (const SideLabel& label : labels)
    commands += fmt::format("set label {} at graph 1.012,{:.4f} left textcolor rgb \"{}\" noenhanced\n",
                            in_quotes(label.text), label.y, label.colour);
  return commands;
}

}  // namespace wienertree::app
