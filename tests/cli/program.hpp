#pragma once
/// Runs the program `wienertree` as its users do, in a directory of its own.
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cli {

/// How a run ended and what it said.
struct Outcome {
  int code = -1;   ///< exit code, -1 if a signal ended it
  int signal = 0;  ///< 0 if none did
  std::string out, err;
};

class Workplace;

/// The program while it runs.
class Running {
 public:
  Running(Running&& other) noexcept;
  ~Running();  ///< kills it if it has not been waited for
  void signal(int number) const;
  /// Where it was started by pipes: writes to its standard input.
  void tell(const std::string& text) const;
  /// The next line of its standard output, without its end; empty after a minute or at the end.
  std::string read_line() const;
  void end_input();
  /// Waits for its end. By pipes: what is left of its standard output.
  Outcome finish();

 private:
  friend class Workplace;
  Running() = default;
  std::unique_ptr<Workplace> captured_;
  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
};

/// A directory that goes with the object.
class Workplace {
 public:
  Workplace();
  ~Workplace();
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;
  const std::filesystem::path& directory() const { return directory_; }

  void write(const std::string& name, const std::string& content) const;
  std::string read(const std::string& name) const;
  std::vector<std::string> files() const;  ///< names, sorted

  std::map<std::string, std::string> environment;       ///< set in addition to the test's own
  std::string input;                                    ///< standard input
  std::string input_from;                               ///< what standard input is instead, if not empty
  std::string stdout_to;                                ///< a file, or "closed pipe"; empty: captured
  unsigned long largest_file = 0;                       ///< bytes a file may have, 0 for any
  std::optional<std::chrono::microseconds> kill_after;  ///< SIGKILL, if it still runs then

  /// Runs the program with these arguments, split at spaces.
  Outcome run(const std::string& arguments) const;
  /// The same with arguments that may hold spaces.
  Outcome run(const std::vector<std::string>& words) const;
  /// Starts it. `by_pipes`: with pipes to its standard input and from its standard output.
  Running start(const std::string& arguments, bool by_pipes = false) const;
  Running start(std::vector<std::string> words, bool by_pipes = false) const;

 private:
  std::filesystem::path directory_;
};

/// Standard output of a run. @throws std::runtime_error with what it said if it did not end with 0
std::string output_of(const Workplace& place, const std::string& arguments);

std::vector<std::string> lines_of(const std::string& text);

/// A CSV table by column.
class Columns {
 public:
  explicit Columns(const std::string& csv);
  const std::vector<std::string>& names() const { return names_; }
  bool has(const std::string& name) const { return values_.contains(name); }
  /// @throws std::out_of_range if there is no such column
  const std::vector<double>& operator[](const std::string& name) const { return values_.at(name); }
  std::size_t rows() const { return values_.at(names_.front()).size(); }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::vector<double>> values_;
};

/// 400 rows of benes on [0, 4], seed 3, as Y.csv, with the signal as X.csv.
void simulate_benes(const Workplace& workplace);

}  // namespace cli
