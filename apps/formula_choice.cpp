#include "formula_choice.hpp"

#include <fmt/format.h>

#include "data_directory.hpp"
#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/model/error.hpp"

namespace wienertree::app {

CubatureFormula choose_formula(std::optional<std::uint64_t> degree, const std::optional<std::string>& formula,
                               std::size_t noise_dimension) {
  const int p = static_cast<int>(noise_dimension);
  if (!formula) return find_formula(static_cast<int>(degree.value_or(5)), p, formulas_directory());
  if (degree) throw InputError("give --formula or --degree, not both", "--formula", *formula);
  CubatureFormula chosen = load_formula(formula_path(*formula, "--formula"));
  if (chosen.dimension != p)
    throw InputError(fmt::format("is for {} Brownian motion{}, the model has {}", chosen.dimension,
                                 chosen.dimension == 1 ? "" : "s", p),
                     "--formula", *formula);
  return chosen;
}

}  // namespace wienertree::app
