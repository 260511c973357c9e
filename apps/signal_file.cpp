#include "signal_file.hpp"

#include <fstream>

#include "run_files.hpp"

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
  note_input("--signal", file);
  std::ifstream in(file);
  if (!in) throw InputError("cannot be opened", file);
  const std::vector<std::string> columns = signal_columns(model);
  ObservationReader reader(in, file, columns, ObservationKind::discrete);
  return read_rows(reader, file, columns.size() - 1, ObservationKind::discrete);
}

}  // namespace wienertree::app
