#include "signal_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <iterator>
#include <sstream>

namespace wienertree::app {
namespace {

std::vector<std::string> signal_columns(const Model& model) {
  std::vector<std::string> columns = {"t"};
  columns.insert(columns.end(), model.state_names.begin(),
                 model.state_names.begin() + static_cast<std::ptrdiff_t>(model.reported_dimension()));
  return columns;
}

}  // namespace

Table signal_table(const Model& model, const ObservationPath& signal) {
  Table table{signal_columns(model), {}};
  for (std::size_t r = 0; r < signal.rows(); ++r) {
    std::vector<double> row = {signal.times[r]};
    row.insert(row.end(), signal.row(r).begin(), signal.row(r).end());
    table.rows.push_back(std::move(row));
  }
  return table;
}

ObservationPath read_signal(const std::string& file, const Model& model) {
  std::ifstream in(file);
  if (!in) throw InputError("cannot be opened", file);
  const std::vector<std::string> columns = signal_columns(model);
  std::string header;
  std::getline(in, header);
  if (header.ends_with('\r')) header.pop_back();
  if (header != fmt::format("{}", fmt::join(columns, ",")))
    throw InputError(fmt::format("the header of a signal of this model is {}", fmt::join(columns, ",")),
                     file + ":1", header.substr(0, 60));
  // From here on it is read like observations, whose columns have other names.
  std::string renamed = "t";
  for (std::size_t i = 1; i < columns.size(); ++i) renamed += fmt::format(",y{}", i);
  std::stringstream rest;
  rest << renamed << '\n' << in.rdbuf();
  rest.clear();  // set by a file that ends after its header
  return read_observations(rest, file, columns.size() - 1, ObservationKind::discrete);
}

}  // namespace wienertree::app
