#include "study_journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>

#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/numeric/read_all.hpp"

namespace wienertree::app {
namespace {

std::string reason() { return std::generic_category().message(errno); }

void add_number(std::string& line, double number) {
  line += ',';
  if (!std::isnan(number)) fmt::format_to(std::back_inserter(line), "{}", number);
}

// The fields of a line; quotes taken off.
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      fields.back() += line[++i];
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == ',' && !quoted)
      fields.emplace_back();
    else
      fields.back() += line[i];
  }
  return fields;
}

template <class Number>
bool parse_whole(const std::string& text, Number& number) {
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  return status == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string StudyJournal::header() const {
  std::string line = "identity,cell,path,launch";
  for (const std::string& q : quantities_) line += fmt::format(",{0},{0}_reference", q);
  return line + ",nodes,ode_solves,seconds\n";
}

std::string StudyJournal::line_of(const RunRecord& r) const {
  std::string line = fmt::format("{},{},{},{}", csv_field(r.identity), csv_field(r.cell), r.path, r.launch);
  for (std::size_t q = 0; q < quantities_.size(); ++q) {
    add_number(line, r.value[q]);
    add_number(line, r.truth[q]);
  }
  for (const double number : {r.nodes, r.ode_solves, r.seconds}) add_number(line, number);
  return line + '\n';
}

RunRecord StudyJournal::parse(const std::string& line, std::size_t number) const {
  const std::vector<std::string> fields = fields_of(line);
  const auto bad = [&](const std::string& what) {
    return InputError(what, fmt::format("{}:{}", file_, number), line.substr(0, 80));
  };
  if (fields.size() != 7 + 2 * quantities_.size()) throw bad("not the fields of a run");
  RunRecord r;
  r.identity = fields[0];
  r.cell = fields[1];
  if (!parse_whole(fields[2], r.path) || !parse_whole(fields[3], r.launch))
    throw bad("path and launch must be whole numbers");
  std::size_t at = 4;
  const auto next = [&] {
    double value = std::numeric_limits<double>::quiet_NaN();
    const std::string& text = fields[at++];
    if (!text.empty() && !parse_whole(text, value)) throw bad("must be a number");
    return value;
  };
  for (std::size_t q = 0; q < quantities_.size(); ++q) {
    r.value.push_back(next());
    r.truth.push_back(next());
  }
  r.nodes = next();
  r.ode_solves = next();
  r.seconds = next();
  return r;
}

// After the constructor it delegates to, what this one opens is closed by the destructor also where it throws.
StudyJournal::StudyJournal(const std::string& directory, std::vector<std::string> quantities)
    : StudyJournal(directory + "/runs.csv", std::move(quantities), Nothing{}) {
  descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw InputError("cannot be written: " + reason(), "--output", file_);
  whole_ = std::make_unique<OutputFile>("--output", file_);
  std::ifstream in(file_, std::ios::binary);
  std::string text = read_all(in, static_cast<std::size_t>(memory_limit() / 8), file_);
  const std::size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
  if (whole < text.size() && ::ftruncate(descriptor_, static_cast<off_t>(whole)) != 0)
    throw RunError("cannot be shortened: " + reason(), "--output", file_);
  text.resize(whole);
  std::istringstream lines(text);
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (number > 1)
      records_.push_back(parse(line, number));
    else if (line + '\n' != header())
      throw InputError("holds the runs of a study of other quantities: give another directory", "--output",
                       file_);
  }
  if (text.empty()) write_line(header());
}

StudyJournal::~StudyJournal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void StudyJournal::append(const RunRecord& record) { write_line(line_of(record)); }

// A run that is killed leaves whole lines, and at most a part of one at the end; a disk that is full, whole
// lines.
void StudyJournal::write_line(const std::string& line) {
  const off_t before = ::lseek(descriptor_, 0, SEEK_END);
  const int error = write_all(descriptor_, line);
  if (error == 0) return;
  if (before >= 0 && ::ftruncate(descriptor_, before) != 0) {
    // The next run cuts off what is left of the line.
  }
  throw RunError("cannot be written: " + std::generic_category().message(error), "--output", file_);
}

void StudyJournal::rewrite(const std::vector<RunRecord>& records) {
  std::string text = header();
  for (const RunRecord& record : records) text += line_of(record);
  whole_->stage(std::move(text));
  whole_->publish();
  records_ = records;
}

}  // namespace wienertree::app
