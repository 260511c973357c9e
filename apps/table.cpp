#include "table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace wienertree::app {

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
  std::string text = csv_header(table.columns);
  for (const std::vector<double>& row : table.rows) text += csv_row(row);
  return text;
}

std::string to_json(const Json& report, const Table& table) {
  constexpr auto replace = Json::error_handler_t::replace;
  std::string text = report.dump(2, ' ', false, replace);
  text.pop_back();  // the closing brace
  text.resize(text.find_last_not_of("\n ") + 1);
  text += report.empty() ? "\n  \"rows\": [" : ",\n  \"rows\": [";
  const char* separator = "\n    ";
  for (const std::vector<double>& row : table.rows) {
    Json object = Json::object();
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
