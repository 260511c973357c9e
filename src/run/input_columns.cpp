#include "wienertree/run/input_columns.hpp"

#include <algorithm>
#include <fstream>

#include "wienertree/filter/observations.hpp"

namespace wienertree {
namespace {

std::ifstream opened(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw InputError("cannot be opened", file);
  if (in.peek(); in.bad()) throw InputError("cannot be read", file);
  return in;
}

bool skips_all(std::string_view) { return true; }

}  // namespace

std::vector<InputFunction> read_input_columns(const std::string& file,
                                              const std::vector<std::string>& names) {
  std::ifstream in = opened(file);
  std::vector<std::string> columns = {"t"};
  columns.insert(columns.end(), names.begin(), names.end());
  // As of a path no value is missing.
  ObservationReader reader(in, file, columns, ObservationKind::continuous, skips_all);
  const ObservationPath path = read_rows(reader, file, names.size(), ObservationKind::discrete);
  std::vector<InputFunction> functions;
  for (std::size_t k = 0; k < names.size(); ++k) {
    InputFunction& f = functions.emplace_back();
    f.name = names[k];
    f.times = path.times;
    for (std::size_t r = 0; r < path.rows(); ++r) f.values.push_back(path.row(r)[k]);
  }
  return functions;
}

bool has_columns(const std::string& file, const std::vector<std::string>& names) {
  std::ifstream in = opened(file);
  std::vector<std::string> found;
  ObservationReader reader(in, file, {"t"}, ObservationKind::discrete, [&](std::string_view name) {
    found.emplace_back(name);
    return true;
  });
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return std::find(found.begin(), found.end(), name) != found.end();
  });
}

}  // namespace wienertree
