#include "formula_choice.hpp"

#include <fmt/format.h>

#include <set>

#include "data_directory.hpp"
#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/lie_formula_file.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::app {
namespace {

void require_dimension(int dimension, int p, const std::string& formula) {
  if (dimension == p) return;
  throw InputError(
      fmt::format("is for {} Brownian motion{}, the model has {}", dimension, dimension == 1 ? "" : "s", p),
      "--formula", formula);
}

}  // namespace

std::vector<int> formula_degrees(std::size_t noise_dimension) {
  const int p = static_cast<int>(noise_dimension);
  std::set<int> degrees = {3};
  if (p <= gaussian_cubature_5_max_dimension) degrees.insert(5);
  for (const std::string& name : bundled_names("cubature_formulas", ".json")) {
    const CubatureFormula formula = read_formula(formula_path(name, "--degree"));
    if (formula.dimension == p) degrees.insert(formula.degree);
  }
  return {degrees.begin(), degrees.end()};
}

std::optional<LieFormula> choose_lie_formula(std::optional<std::uint64_t> degree,
                                             const std::optional<std::string>& formula,
                                             std::size_t noise_dimension) {
  if (!formula) return {};
  const auto file = formula_path(*formula, "--formula");
  if (!is_lie_formula(file)) return {};
  if (degree) throw InputError("give --formula or --degree, not both", "--formula", *formula);
  LieFormula chosen = load_lie_formula(file);
  require_dimension(chosen.dimension, static_cast<int>(noise_dimension), *formula);
  return chosen;
}

CubatureFormula choose_formula(std::optional<std::uint64_t> degree, const std::optional<std::string>& formula,
                               std::size_t noise_dimension) {
  const int p = static_cast<int>(noise_dimension);
  if (!formula) return find_formula(static_cast<int>(degree.value_or(5)), p, formulas_directory());
  if (degree) throw InputError("give --formula or --degree, not both", "--formula", *formula);
  CubatureFormula chosen = load_formula(formula_path(*formula, "--formula"));
  require_dimension(chosen.dimension, p, *formula);
  return chosen;
}

}  // namespace wienertree::app
