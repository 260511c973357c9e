#include "wienertree/cubature/formula_file.hpp"

#include <fmt/format.h>

#include "wienertree/cubature/formula_keys.hpp"
#include "wienertree/cubature/json_fields.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

using json::Json;

CubaturePath path_from(const Json& object, int p, const std::string& where) {
  json::check_keys(object, path_keys, where);
  CubaturePath path;
  path.weight = json::number(object.at("weight"), "\"weight\"", where);
  const Json& segments = json::array_at(object, "segments", where);
  // Widths are checked before anything is allocated: a huge stated dimension must not exhaust the memory.
  for (std::size_t s = 0; s < segments.size(); ++s) {
    if (!segments[s].is_array() || segments[s].size() != static_cast<std::size_t>(p) + 1)
      throw InputError(fmt::format("a segment of dimension {} is an array of {} numbers", p, p + 1),
                       fmt::format("{}, segment {}", where, s + 1), json::brief(segments[s]));
  }
  path.increments.resize(p + 1, static_cast<Eigen::Index>(segments.size()));
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (std::size_t i = 0; i < segments[s].size(); ++i)
      path.increments(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(s)) =
          json::number(segments[s][i], "an increment", fmt::format("{}, segment {}", where, s + 1));
  }
  return path;
}

}  // namespace

CubatureFormula parse_formula(const std::string& text, const std::string& where) {
  const Json root = json::parse(text, where);
  if (root.is_object() && root.value("kind", Json()) == "lie")
    throw InputError("this is a formula of Lie polynomials, not of paths", where);
  json::check_keys(root, formula_keys, where);
  CubatureFormula formula;
  formula.name = json::string_at(root, "name", where);
  formula.source = json::string_at(root, "source", where);
  formula.degree = json::positive_integer_at(root, "degree", where);
  formula.dimension = json::positive_integer_at(root, "dimension", where);
  for (const Json& path : json::array_at(root, "paths", where)) {
    const std::string here = fmt::format("{}: path {}", where, formula.paths.size() + 1);
    formula.paths.push_back(path_from(path, formula.dimension, here));
  }
  check_structure(formula, where);
  return formula;
}

CubatureFormula read_formula(const std::filesystem::path& file) {
  return parse_formula(json::text_of_file(file), file.string());
}

CubatureFormula load_formula(const std::filesystem::path& file) {
  CubatureFormula formula = read_formula(file);
  require_holds(verify(formula, moment_tolerance, false), file.string());
  return formula;
}

std::string format_formula(const CubatureFormula& formula) {
  check_structure(formula, formula.name);
  std::string text =
      fmt::format("{{\"name\": {}, \"degree\": {}, \"dimension\": {}, \"source\": {}, \"paths\": [\n",
                  json::quoted(formula.name, "name", formula.name), formula.degree, formula.dimension,
                  json::quoted(formula.source, "source", formula.name));
  for (std::size_t j = 0; j < formula.paths.size(); ++j) {
    const CubaturePath& path = formula.paths[j];
    text += fmt::format("  {{\"weight\": {:.17g}, \"segments\": [", path.weight);
    for (Eigen::Index s = 0; s < path.increments.cols(); ++s) {
      const auto column = path.increments.col(s);
      text += fmt::format("{}[{:.17g}]", s == 0 ? "" : ", ", fmt::join(column.begin(), column.end(), ", "));
    }
    text += j + 1 < formula.paths.size() ? "]},\n" : "]}\n";
  }
  return text + "]}\n";
}

void save_formula(const CubatureFormula& formula, const std::filesystem::path& file) {
  json::replace_file(file, format_formula(formula));
}

}  // namespace wienertree
