#include "wienertree/filter/observations.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <ostream>
#include <string_view>

namespace wienertree {
namespace {

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r')) s.remove_suffix(1);
  return s;
}

// The next comma-separated field of `line`, which loses it; `last` tells whether it was the final one.
std::string_view take_field(std::string_view& line, bool& last) {
  const std::size_t comma = line.find(',');
  last = comma == std::string_view::npos;
  const std::string_view field = trimmed(line.substr(0, comma));
  line.remove_prefix(last ? line.size() : comma + 1);
  return field;
}

// Long or binary input must not flood a message.
std::string shown(std::string_view text) {
  constexpr std::size_t longest = 60;
  std::string out;
  for (const char c : text.substr(0, longest)) out += (c >= ' ' && c != '\x7f') ? c : '?';
  return text.size() > longest ? out + "..." : out;
}

std::string column_name(std::size_t column) { return column == 0 ? "t" : fmt::format("y{}", column); }

void require_rows(std::size_t rows, const std::string& origin, ObservationKind kind) {
  if (rows == 0) throw InputError("there are no rows", origin);
  if (kind == ObservationKind::continuous && rows < 2)
    throw InputError("a continuous observation needs at least two rows: its start and one more", origin);
}

}  // namespace

void ObservationPath::append(double time, std::span<const double> value) {
  times.push_back(time);
  values.insert(values.end(), value.begin(), value.end());
}

ObservationReader::ObservationReader(std::istream& in, std::string origin, std::size_t dimension,
                                     ObservationKind kind)
    : in_(in),
      origin_(std::move(origin)),
      dimension_(dimension),
      kind_(kind),
      last_time_(-std::numeric_limits<double>::infinity()) {
  std::string expected = "t";
  for (std::size_t i = 1; i <= dimension_; ++i) expected += fmt::format(",y{}", i);
  if (!std::getline(in_, line_))
    throw in_.bad() ? InputError("reading failed", origin_ + ":1")
                    : InputError("empty: expected the header " + expected, origin_);
  ++line_number_;
  std::string_view rest = line_;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);  // byte order mark of some spreadsheets
  bool last = false;
  for (std::size_t column = 0; !last; ++column) {
    const std::string_view name = take_field(rest, last);
    if (column > dimension_ || name != column_name(column) || (last && column != dimension_))
      throw InputError(fmt::format("the model observes {} component{}: expected the header {}", dimension_,
                                   dimension_ == 1 ? "" : "s", expected),
                       origin_ + ":1", shown(line_));
  }
}

bool ObservationReader::next(double& t, std::span<double> y) {
  do {
    if (!std::getline(in_, line_)) {
      if (in_.bad()) throw InputError("reading failed", fmt::format("{}:{}", origin_, line_number_ + 1));
      return false;
    }
    ++line_number_;
  } while (trimmed(line_).empty());
  std::string_view rest = line_;
  const auto fail = [&](const std::string& message, std::size_t column, std::string_view value) {
    throw InputError(message, fmt::format("{}:{}: column {}", origin_, line_number_, column_name(column)),
                     shown(value));
  };
  bool last = false;
  for (std::size_t column = 0; column <= dimension_; ++column) {
    if (last) fail("the row ends early", column, line_);
    const std::string_view field = take_field(rest, last);
    double value = std::numeric_limits<double>::quiet_NaN();
    if (field.empty()) {
      if (column == 0 || kind_ == ObservationKind::continuous) fail("a value is missing", column, line_);
    } else {
      const auto [end, status] = std::from_chars(field.data(), field.data() + field.size(), value);
      if (status != std::errc() || end != field.data() + field.size()) fail("not a number", column, field);
      if (!std::isfinite(value)) fail("not a finite number", column, field);
    }
    if (column == 0) {
      if (!(value > last_time_))
        fail("times must increase", column, fmt::format("{} after {}", field, last_time_));
      last_time_ = t = value;
    } else {
      y[column - 1] = value;
    }
  }
  if (!last) fail("the row has too many fields", dimension_, line_);
  return true;
}

void check_observations(const ObservationRows& rows, const std::string& origin, ObservationKind kind) {
  if (rows.values.size() != rows.rows() * rows.dimension)
    throw InputError(fmt::format("expected {} value{} for each time, the components the model observes",
                                 rows.dimension, rows.dimension == 1 ? "" : "s"),
                     origin, fmt::format("{} values for {} times", rows.values.size(), rows.rows()));
  require_rows(rows.rows(), origin, kind);
  const auto fail = [&](const char* message, std::size_t row, std::size_t column, double value) {
    throw InputError(message, fmt::format("{}: row {}, column {}", origin, row + 1, column_name(column)),
                     fmt::format("{}", value));
  };
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    if (!std::isfinite(rows.times[r])) fail("not a finite number", r, 0, rows.times[r]);
    if (r > 0 && !(rows.times[r] > rows.times[r - 1])) fail("times must increase", r, 0, rows.times[r]);
    for (std::size_t i = 0; i < rows.dimension; ++i) {
      const double y = rows.row(r)[i];
      if (std::isinf(y)) fail("not a finite number", r, i + 1, y);
      if (std::isnan(y) && kind == ObservationKind::continuous) fail("a value is missing", r, i + 1, y);
    }
  }
}

ObservationPath read_observations(std::istream& in, const std::string& origin, std::size_t dimension,
                                  ObservationKind kind) {
  ObservationReader reader(in, origin, dimension, kind);
  ObservationPath path;
  path.dimension = dimension;
  double t = 0;
  std::vector<double> y(dimension);
  while (reader.next(t, y)) path.append(t, y);
  require_rows(path.rows(), origin, kind);
  return path;
}

ObservationPath read_observations(const std::string& path, std::size_t dimension, ObservationKind kind) {
  std::ifstream in(path);
  if (!in) throw InputError("cannot be opened", path);
  if (in.peek(); in.bad()) throw InputError("cannot be read", path);
  return read_observations(in, path, dimension, kind);
}

void write_observations(std::ostream& out, const ObservationPath& path) {
  out << 't';
  for (std::size_t i = 1; i <= path.dimension; ++i) out << ",y" << i;
  out << '\n';
  for (std::size_t r = 0; r < path.rows(); ++r) {
    out << fmt::format("{:.17g}", path.times[r]);
    for (const double y : path.row(r)) {
      out << ',';
      if (!std::isnan(y)) out << fmt::format("{:.17g}", y);
    }
    out << '\n';
  }
}

}  // namespace wienertree
