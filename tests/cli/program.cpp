#include "program.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>

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

Outcome Workplace::run(const std::string& arguments) const {
  // What is captured lies outside the working directory, whose files tests look at.
  const Workplace captured;
  const std::string in = (captured.directory_ / "in").string(), out = (captured.directory_ / "out").string(),
                    err = (captured.directory_ / "err").string();
  captured.write("in", input);
  std::vector<std::string> words = split(arguments, ' ');
  words.insert(words.begin(), WIENERTREE_PROGRAM);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    if (::chdir(directory_.c_str()) != 0) ::_exit(126);
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    connect(STDIN_FILENO, in, O_RDONLY);
    connect(STDERR_FILENO, err, O_WRONLY | O_CREAT);
    if (stdout_to == "closed pipe") {
      int ends[2];
      if (::pipe(ends) != 0 || ::dup2(ends[1], STDOUT_FILENO) < 0) ::_exit(126);
      ::close(ends[0]);
      ::close(ends[1]);
    } else {
      connect(STDOUT_FILENO, stdout_to.empty() ? out : stdout_to, O_WRONLY | O_CREAT);
    }
    if (largest_file > 0) {
      const struct rlimit limit { largest_file, largest_file };
      if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(126);
    }
    ::execv(argv.front(), argv.data());
    ::_exit(127);
  }
  int status = 0;
  if (kill_after) {
    std::this_thread::sleep_for(*kill_after);
    ::kill(child, SIGKILL);
  }
  ::waitpid(child, &status, 0);
  Outcome outcome;
  if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  outcome.out = content_of(out);
  outcome.err = content_of(err);
  return outcome;
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
