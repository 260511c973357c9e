#pragma once
/// A table of numbers as CSV or JSON.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace wienertree::app {

using Json = nlohmann::ordered_json;

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;  ///< each as long as `columns`
  std::string label_column = {};          ///< name of a first column of text; empty: there is none
  std::vector<std::string> labels = {};   ///< its text, one a row
};

enum class TableFormat { csv, json };

/// "a,b,c\n"
std::string csv_header(const std::vector<std::string>& columns);
/// The shortest text that reads back as the same number; NaN is an empty field.
std::string csv_row(const std::vector<double>& row);
std::string to_csv(const Table& table);

/// `report` (an object) with a last key "rows": one object a row, under the names of the columns. What is not
/// finite is null.
std::string to_json(const Json& report, const Table& table);

}  // namespace wienertree::app
