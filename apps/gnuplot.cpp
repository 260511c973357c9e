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

#include "wienertree/model/text/printable.hpp"
#include "wienertree/numeric/error.hpp"

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

// What gnuplot needs of the environment to start and to find fonts. Nothing else reaches it, so that no GNUTERM,
// GNUPLOT_LIB, GNUPLOT_FONTPATH, GDFONTPATH or locale changes a picture.
std::vector<std::string> environment_of_child() {
  std::vector<std::string> kept;
  for (const char* name : {"PATH", "HOME", "TMPDIR", "XDG_CACHE_HOME", "LD_LIBRARY_PATH", "FONTCONFIG_FILE",
                           "FONTCONFIG_PATH", "FONTCONFIG_SYSROOT"})
    if (const char* value = std::getenv(name)) kept.push_back(fmt::format("{}={}", name, value));
  return kept;
}

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
    add("set terminal svg size {},{} font \"Helvetica,14\" enhanced background rgb \"white\" linewidth 1",
        width, height);
  else
    add("set terminal pngcairo size {},{} font \"Sans,12\" fontscale 1.9 enhanced linewidth 2", 2 * width,
        2 * height);
  add("set encoding utf8\nset minussign\nset border 3 lw 0.8 lc rgb \"#444444\"\nset tics nomirror out scale "
      "0.6\nunset "
      "key");
}

void Picture::add_data(const Script& name, std::span<const std::vector<double>> columns) {
  script_ += fmt::format("${} << END_OF_DATA\n", name.text());
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
  std::vector<std::string> kept = environment_of_child();
  std::vector<char*> environment;
  for (std::string& setting : kept) environment.push_back(setting.data());
  environment.push_back(nullptr);
  pid_t child = 0;
  const int error =
      ::posix_spawn(&child, program_.c_str(), &files, nullptr, arguments.data(), environment.data());
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

Script gnuplot_string(std::string_view text) {
  // Not a digit: gnuplot would count it to an octal code before it.
  const auto stands_for_itself = [](unsigned char c) {
    return c == ' ' || c >= 0x80 || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
  };
  std::string out = "\"";
  for (const char c : text::printable(text))
    out += stands_for_itself(static_cast<unsigned char>(c))
               ? std::string(1, c)
               : fmt::format("\\{:03o}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  return Script(out + '"');
}

Script joined(const std::vector<Script>& pieces) {
  Script all;
  for (const Script& piece : pieces) all += all.empty() ? piece : command(", {}", piece);
  return all;
}

Script name_of_height(const std::string& text, double x) {
  return command("set label {} at screen {:.4f}, graph 0.5 center rotate by 90 noenhanced",
                 gnuplot_string(text), x);
}

Script name_of_width(const std::string& text, double y) {
  return command("set label {} at graph 0.5, screen {:.4f} center noenhanced", gnuplot_string(text), y);
}

Script labels_at_right(std::vector<SideLabel> labels, double spacing) {
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
  Script commands;
  for (const SideLabel& label : labels)
    commands += command("set label {} at graph 1.012,{:.4f} left textcolor rgb \"{}\" noenhanced\n",
                        gnuplot_string(label.text), label.y, label.colour);
  return commands;
}

}  // namespace wienertree::app
