#include "program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace cli {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);)
    if (!part.empty() || separator != ' ') parts.push_back(part);
  if (text.ends_with(separator) && separator == ',') parts.emplace_back();
  return parts;
}

void connect(int descriptor, const std::string& file, int flags) {
  const int opened = ::open(file.c_str(), flags, 0600);
  if (opened < 0 || ::dup2(opened, descriptor) < 0) ::_exit(126);
}

}  // namespace

Workplace::Workplace() {
  std::string name = (fs::temp_directory_path() / "wienertree-cli-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary directory");
  directory_ = fs::canonical(name);
}

Workplace::~Workplace() {
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

void Workplace::write(const std::string& name, const std::string& content) const {
  std::ofstream(directory_ / name, std::ios::binary) << content;
}

std::string Workplace::read(const std::string& name) const { return content_of(directory_ / name); }

std::vector<std::string> Workplace::files() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory_))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

Running Workplace::start(const std::string& arguments, bool by_pipes) const {
  return start(split(arguments, ' '), by_pipes);
}

Running Workplace::start(std::vector<std::string> words, bool by_pipes) const {
  Running running;
  // What is captured lies outside the working directory, whose files tests look at.
  running.captured_ = std::make_unique<Workplace>();
  const fs::path& captured = running.captured_->directory_;
  const std::string in = (captured / "in").string(), out = (captured / "out").string(),
                    err = (captured / "err").string();
  running.captured_->write("in", input);
  std::string program = WIENERTREE_PROGRAM;
  std::vector<char*> argv = {program.data()};
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  int to[2] = {-1, -1}, from[2] = {-1, -1};
  if (by_pipes && (::pipe2(to, O_CLOEXEC) != 0 || ::pipe2(from, O_CLOEXEC) != 0))
    throw std::runtime_error("pipe failed");

  // A signal that comes before the program is there must not meet the test's own handlers.
  sigset_t all, before;
  ::sigfillset(&all);
  ::sigprocmask(SIG_BLOCK, &all, &before);
  const pid_t child = ::fork();
  if (child == 0) {
    for (const int number : {SIGTERM, SIGINT}) std::signal(number, SIG_DFL);
  }
  ::sigprocmask(SIG_SETMASK, &before, nullptr);
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    if (::chdir(directory_.c_str()) != 0) ::_exit(126);
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    connect(STDERR_FILENO, err, O_WRONLY | O_CREAT);
    if (by_pipes) {
      if (::dup2(to[0], STDIN_FILENO) < 0 || ::dup2(from[1], STDOUT_FILENO) < 0) ::_exit(126);
    } else {
      connect(STDIN_FILENO, input_from.empty() ? in : input_from, O_RDONLY);
      if (stdout_to == "closed pipe") {
        int ends[2];
        if (::pipe(ends) != 0 || ::dup2(ends[1], STDOUT_FILENO) < 0) ::_exit(126);
        ::close(ends[0]);
        ::close(ends[1]);
      } else {
        connect(STDOUT_FILENO, stdout_to.empty() ? out : stdout_to, O_WRONLY | O_CREAT);
      }
    }
    if (largest_file > 0) {
      const struct rlimit limit { largest_file, largest_file };
      if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(126);
    }
    ::execv(argv.front(), argv.data());
    ::_exit(127);
  }
  running.process_ = child;
  if (by_pipes) {
    ::close(to[0]);
    ::close(from[1]);
    running.to_ = to[1];
    running.from_ = from[0];
  }
  return running;
}

Outcome Workplace::run(const std::string& arguments) const { return run(split(arguments, ' ')); }

Outcome Workplace::run(const std::vector<std::string>& words) const {
  Running running = start(words);
  if (kill_after) {
    std::this_thread::sleep_for(*kill_after);
    running.signal(SIGKILL);
  }
  return running.finish();
}

Running::Running(Running&& other) noexcept
    : captured_(std::move(other.captured_)),
      process_(std::exchange(other.process_, -1)),
      to_(std::exchange(other.to_, -1)),
      from_(std::exchange(other.from_, -1)) {}

Running::~Running() {
  if (process_ <= 0) return;
  ::kill(process_, SIGKILL);
  finish();
}

void Running::signal(int number) const { ::kill(process_, number); }

void Running::tell(const std::string& text) const {
  if (::write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the program takes no input");
}

std::string Running::read_line() const {
  std::string line;
  pollfd waiting{from_, POLLIN, 0};
  for (char c = 0; ::poll(&waiting, 1, 60000) == 1 && ::read(from_, &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

void Running::end_input() {
  if (to_ >= 0) ::close(to_);
  to_ = -1;
}

Outcome Running::finish() {
  end_input();
  Outcome outcome;
  if (from_ >= 0) {
    for (char c = 0; ::read(from_, &c, 1) == 1;) outcome.out += c;
    ::close(from_);
    from_ = -1;
  }
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) continue;
  process_ = -1;
  if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  if (outcome.out.empty()) outcome.out = captured_->read("out");
  outcome.err = captured_->read("err");
  return outcome;
}

std::string output_of(const Workplace& place, const std::string& arguments) {
  const Outcome outcome = place.run(arguments);
  if (outcome.code != 0) throw std::runtime_error(arguments + "\n" + outcome.err);
  return outcome.out;
}

std::vector<std::string> lines_of(const std::string& text) { return split(text, '\n'); }

Columns::Columns(const std::string& csv) {
  const std::vector<std::string> lines = lines_of(csv);
  if (lines.empty()) throw std::runtime_error("an empty table");
  names_ = split(lines.front(), ',');
  for (std::size_t r = 1; r < lines.size(); ++r) {
    const std::vector<std::string> fields = split(lines[r], ',');
    if (fields.size() != names_.size()) throw std::runtime_error("a ragged table: " + lines[r]);
    for (std::size_t i = 0; i < fields.size(); ++i)
      values_[names_[i]].push_back(fields[i].empty() ? std::numeric_limits<double>::quiet_NaN()
                                                     : std::stod(fields[i]));
  }
}

void simulate_benes(const Workplace& workplace) {
  const Outcome outcome = workplace.run(
      "simulate benes --horizon 4 --steps 4000 --keep 400 --seed 3 --observations Y.csv --signal X.csv");
  if (outcome.code != 0) throw std::runtime_error(outcome.err);
}

}  // namespace cli
