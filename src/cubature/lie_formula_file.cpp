#include "wienertree/cubature/lie_formula_file.hpp"

#include <fmt/format.h>

#include "wienertree/cubature/formula_keys.hpp"
#include "wienertree/cubature/json_fields.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

using json::Json;

LieElement element_from(const Json& object, const std::string& where) {
  json::check_keys(object, lie_element_keys, where);
  LieElement element;
  element.weight = json::number(object.at("weight"), "\"weight\"", where);
  for (const Json& term : json::array_at(object, "terms", where)) {
    const std::string here = fmt::format("{}, term {}", where, element.terms.size() + 1);
    json::check_keys(term, lie_term_keys, here);
    element.terms.push_back({LieBracket::parse(json::string_at(term, "bracket", here), here),
                             json::number(term.at("coefficient"), "\"coefficient\"", here)});
  }
  return element;
}

}  // namespace

LieFormula parse_lie_formula(const std::string& text, const std::string& where) {
  const Json root = json::parse(text, where);
  json::check_keys(root, lie_formula_keys, where);
  if (json::string_at(root, "kind", where) != "lie")
    throw InputError("\"kind\" must be \"lie\"", where, json::brief(root.at("kind")));
  LieFormula formula;
  formula.name = json::string_at(root, "name", where);
  formula.source = json::string_at(root, "source", where);
  formula.degree = json::positive_integer_at(root, "degree", where);
  formula.dimension = json::positive_integer_at(root, "dimension", where);
  for (const Json& element : json::array_at(root, "elements", where))
    formula.elements.push_back(
        element_from(element, fmt::format("{}: element {}", where, formula.elements.size() + 1)));
  check_structure(formula, where);
  return formula;
}

bool is_lie_formula(const std::filesystem::path& file) {
  const Json root = json::parse(json::text_of_file(file), file.string());
  return root.is_object() && root.contains("kind") && root.at("kind") == "lie";
}

LieFormula read_lie_formula(const std::filesystem::path& file) {
  return parse_lie_formula(json::text_of_file(file), file.string());
}

LieFormula load_lie_formula(const std::filesystem::path& file) {
  LieFormula formula = read_lie_formula(file);
  require_holds(verify(formula, moment_tolerance, false), file.string());
  return formula;
}

std::string format_formula(const LieFormula& formula) {
  check_structure(formula, formula.name);
  std::string text = fmt::format(
      "{{\"kind\": \"lie\", \"name\": {}, \"degree\": {}, \"dimension\": {}, \"source\": {}, \"elements\": "
      "[\n",
      json::quoted(formula.name, "name", formula.name), formula.degree, formula.dimension,
      json::quoted(formula.source, "source", formula.name));
  for (std::size_t j = 0; j < formula.elements.size(); ++j) {
    const LieElement& element = formula.elements[j];
    text += fmt::format("  {{\"weight\": {:.17g}, \"terms\": [", element.weight);
    for (std::size_t k = 0; k < element.terms.size(); ++k)
      text += fmt::format("{}{{\"bracket\": \"{}\", \"coefficient\": {:.17g}}}", k == 0 ? "" : ", ",
                          element.terms[k].bracket.to_string(), element.terms[k].coefficient);
    text += j + 1 < formula.elements.size() ? "]},\n" : "]}\n";
  }
  return text + "]}\n";
}

void save_formula(const LieFormula& formula, const std::filesystem::path& file) {
  json::replace_file(file, format_formula(formula));
}

}  // namespace wienertree
