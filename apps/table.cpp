#include "table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace wienertree::app {

namespace {

// RFC 4180: quotes around what holds a comma, a quote or a line's end; quotes inside are doubled.
std::string quoted_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace

std::string csv_header(const std::vector<std::string>& columns) {
  return fmt::format("{}\n", fmt::join(columns, ","));
}

std::string csv_row(const std::vector<double>& row) {
  std::string line;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (i > 0) line += ',';
    if (!std::isnan(row[i])) fmt::format_to(std::back_inserter(line), "{}", row[i]);
  }
  return line + '\n';
}

std::string to_csv(const Table& table) {
  if (table.label_column.empty()) {
    std::string text = csv_header(table.columns);
    for (const std::vector<double>& row : table.rows) text += csv_row(row);
    return text;
  }
  std::string text = table.label_column + ',' + csv_header(table.columns);
  for (std::size_t r = 0; r < table.rows.size(); ++r)
    text += quoted_field(table.labels[r]) + ',' + csv_row(table.rows[r]);
  return text;
}

std::string to_json(const Json& report, const Table& table) {
  constexpr auto replace = Json::error_handler_t::replace;
  std::string text = report.dump(2, ' ', false, replace);
  text.pop_back();  // the closing brace
  text.resize(text.find_last_not_of("\n ") + 1);
  text += report.empty() ? "\n  \"rows\": [" : ",\n  \"rows\": [";
  const char* separator = "\n    ";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const std::vector<double>& row = table.rows[r];
    Json object = Json::object();
    if (!table.label_column.empty()) object[table.label_column] = table.labels[r];
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool whole = std::fabs(row[i]) < 1e15 && row[i] == std::floor(row[i]);
      object[table.columns[i]] = whole ? Json(static_cast<std::int64_t>(row[i])) : Json(row[i]);
    }
    text += separator + object.dump(-1, ' ', false, replace);
    separator = ",\n    ";
  }
  return text + "\n  ]\n}\n";
}

}  // namespace wienertree::app
