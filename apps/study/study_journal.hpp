#pragma once
/// The runs of a study on disk: a row each, written as it is finished, so that what was killed can go on.
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "../output.hpp"

namespace wienertree::app {

/// One launch of a cell on one observation path.
struct RunRecord {
  std::string identity;  ///< StudyCell::identity
  std::string cell;      ///< StudyCell::key
  std::size_t path = 0;
  std::uint32_t launch = 0;
  std::vector<double> value, truth;               ///< one a quantity; NaN: there is none
  double nodes = 0, ode_solves = 0, seconds = 0;  ///< seconds of processor time
};

/// runs.csv in the directory of a study.
class StudyJournal {
 public:
  /// Reads what is there. A last line without an end is what a killed run left: it is cut off.
  /// @param directory is this process's (StudyDirectory)
  /// @throws InputError if the file is not that of a study of these quantities, naming the line
  StudyJournal(const std::string& directory, std::vector<std::string> quantities);
  ~StudyJournal();
  StudyJournal(const StudyJournal&) = delete;
  StudyJournal& operator=(const StudyJournal&) = delete;

  const std::vector<RunRecord>& records() const { return records_; }
  /// Writes one line. Not for several threads at once. @throws RunError if it cannot be written; what was
  /// written of it is taken back
  void append(const RunRecord& record);
  /// Puts the file in this order, as a whole. @throws RunError
  void rewrite(const std::vector<RunRecord>& records);

 private:
  struct Nothing {};
  StudyJournal(std::string file, std::vector<std::string> quantities, Nothing)
      : file_(std::move(file)), quantities_(std::move(quantities)) {}
  void write_line(const std::string& line);
  std::string line_of(const RunRecord& record) const;
  std::string header() const;
  RunRecord parse(const std::string& line, std::size_t number) const;

  std::string file_;
  std::vector<std::string> quantities_;
  std::vector<RunRecord> records_;
  int descriptor_ = -1;
  std::unique_ptr<OutputFile> whole_;
};

/// Text as a field of CSV, in quotes where it must be (RFC 4180).
std::string csv_field(const std::string& text);

}  // namespace wienertree::app
