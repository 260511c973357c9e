#include "wienertree/filter/observations.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <ostream>
#include <string_view>

#include "wienertree/numeric/memory.hpp"

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

// Whether a number may have been cut off behind this: 0.4, of which "0." is left.
bool looks_cut_off(std::string_view field) {
  return field.empty() || std::string_view(".eE+-").find(field.back()) != std::string_view::npos;
}

void require_rows(std::size_t rows, const std::string& origin, ObservationKind kind) {
  if (rows == 0) throw InputError("there are no rows", origin);
  if (kind == ObservationKind::continuous && rows < 2)
    throw InputError("a continuous observation needs at least two rows: its start and one more", origin);
}

}  // namespace

std::vector<std::string> observation_columns(std::size_t dimension) {
  std::vector<std::string> names;
  for (std::size_t column = 0; column <= dimension; ++column) names.push_back(column_name(column));
  return names;
}

void ObservationPath::append(double time, std::span<const double> value) {
  times.push_back(time);
  values.insert(values.end(), value.begin(), value.end());
}

ObservationReader::ObservationReader(std::istream& in, std::string origin, std::size_t dimension,
                                     ObservationKind kind)
    : ObservationReader(in, std::move(origin), observation_columns(dimension), kind) {}

ObservationReader::ObservationReader(std::istream& in, std::string origin, std::vector<std::string> columns,
                                     ObservationKind kind, const std::function<bool(std::string_view)>& skips)
    : in_(in),
      origin_(std::move(origin)),
      columns_(std::move(columns)),
      buffer_(new char[longest_line + 1]),
      dimension_(columns_.size() - 1),
      kind_(kind),
      last_time_(-std::numeric_limits<double>::infinity()) {
  read_header(skips);
}

void ObservationReader::read_header(const std::function<bool(std::string_view)>& skips) {
  const std::string expected = fmt::format("{}", fmt::join(columns_, ","));
  if (!read_line()) throw InputError("empty: expected the header " + expected, origin_);
  std::string_view rest = line_;
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);  // byte order mark of some spreadsheets
  const auto fail = [&] {
    const std::string observed =
        columns_.size() > 1 && columns_[1] != column_name(1)
            ? ""
            : fmt::format("the model observes {} component{}: ", dimension_, dimension_ == 1 ? "" : "s");
    throw InputError(
        fmt::format("{}expected the header {}{}", observed, expected, skips ? ", in any order" : ""),
        origin_ + ":1", shown(line_));
  };
  std::vector<bool> seen(columns_.size(), false);
  for (bool last = false; !last;) {
    const std::string_view name = take_field(rest, last);
    const auto column =
        static_cast<std::size_t>(std::find(columns_.begin(), columns_.end(), name) - columns_.begin());
    if (column == columns_.size() ? !(skips && skips(name)) : seen[column]) fail();
    if (!skips && column != fields_.size()) fail();
    if (column < columns_.size()) seen[column] = true;
    fields_.push_back(column);
  }
  if (std::find(seen.begin(), seen.end(), false) != seen.end()) fail();
}

std::string ObservationReader::name_of_field(std::size_t field) const {
  return fields_[field] < columns_.size() ? columns_[fields_[field]] : fmt::format("number {}", field + 1);
}

// The next line, without its end; false at the end of the stream.
bool ObservationReader::read_line() {
  in_.getline(buffer_.get(), static_cast<std::streamsize>(longest_line + 1));
  const auto read = static_cast<std::size_t>(in_.gcount());
  const std::string where = fmt::format("{}:{}", origin_, line_number_ + 1);
  if (in_.bad()) throw InputError("reading failed", where);
  if (in_.eof() && read == 0) return false;
  if (in_.fail())
    throw InputError(fmt::format("the line is longer than {} bytes", longest_line), where,
                     shown({buffer_.get(), read}));
  ended_ = !in_.eof();
  line_ = {buffer_.get(), ended_ ? read - 1 : read};
  ++line_number_;
  return true;
}

bool ObservationReader::next(double& t, std::span<double> y) {
  do {
    if (!read_line()) return false;
  } while (trimmed(line_).empty());
  std::string_view rest = line_;
  const std::size_t last_field = fields_.size() - 1;
  const auto fail = [&](const std::string& message, std::size_t field, std::string_view value) {
    throw InputError(message, fmt::format("{}:{}: column {}", origin_, line_number_, name_of_field(field)),
                     shown(value));
  };
  if (const std::size_t comma = rest.rfind(','); !ended_ && looks_cut_off(trimmed(rest.substr(comma + 1)))) {
    const auto field = static_cast<std::size_t>(std::count(rest.begin(), rest.end(), ','));
    fail("the row is cut off: it has no end of line, and its last field may go on",
         std::min(field, last_field), line_);
  }
  bool last = false;
  for (std::size_t f = 0; f <= last_field; ++f) {
    if (last) fail("the row ends early", f, line_);
    const std::string_view field = take_field(rest, last);
    const std::size_t column = fields_[f];
    if (column == columns_.size()) continue;
    double value = std::numeric_limits<double>::quiet_NaN();
    if (field.empty()) {
      if (column == 0 || kind_ == ObservationKind::continuous) fail("a value is missing", f, line_);
    } else {
      const auto [end, status] = std::from_chars(field.data(), field.data() + field.size(), value);
      if (status != std::errc() || end != field.data() + field.size()) fail("not a number", f, field);
      if (!std::isfinite(value)) fail("not a finite number", f, field);
    }
    if (column == 0) {
      if (!(value > last_time_))
        fail("times must increase", f, fmt::format("{} after {}", field, last_time_));
      last_time_ = t = value;
    } else {
      y[column - 1] = value;
    }
  }
  if (!last) fail("the row has too many fields", last_field, line_);
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
  return read_rows(reader, origin, dimension, kind);
}

ObservationPath read_rows(ObservationReader& reader, const std::string& origin, std::size_t dimension,
                          ObservationKind kind) {
  constexpr std::size_t rows_between_checks = 1 << 16;
  ObservationPath path;
  path.dimension = dimension;
  double t = 0;
  std::vector<double> y(dimension);
  while (reader.next(t, y)) {
    path.append(t, y);
    // Vectors hold up to twice their elements, and three times while they grow.
    if (path.rows() % rows_between_checks == 0)
      require_memory(3.0 * sizeof(double) * static_cast<double>(path.rows() * (1 + dimension)),
                     fmt::format("a record of more than {} rows", path.rows()), origin);
  }
  require_rows(path.rows(), origin, kind);
  return path;
}

std::function<bool(std::string_view)> skips_inputs(const Model& model) {
  if (!model.inputs) return {};
  return [inputs = model.inputs](std::string_view name) {
    return std::ranges::any_of(inputs->functions(), [&](const InputFunction& f) { return f.name == name; });
  };
}

namespace {

ObservationPath read_file(const std::string& path, std::size_t k, ObservationKind kind,
                          const std::function<bool(std::string_view)>& skips) {
  std::ifstream in(path);
  if (!in) throw InputError("cannot be opened", path);
  if (in.peek(); in.bad()) throw InputError("cannot be read", path);
  ObservationReader reader(in, path, observation_columns(k), kind, skips);
  return read_rows(reader, path, k, kind);
}

}  // namespace

ObservationPath read_observations(const std::string& path, std::size_t dimension, ObservationKind kind) {
  return read_file(path, dimension, kind, {});
}

ObservationPath read_observations(const std::string& path, const Model& model) {
  return read_file(path, model.observation_dimension(), model.observation, skips_inputs(model));
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
