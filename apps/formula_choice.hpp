#pragma once
/// Which cubature formula a run uses.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/lie_formula.hpp"

namespace wienertree::app {

/// The formula named by --formula (a bundled name or a file), or else the best at hand of degree --degree, 5
/// if not given. Its moments are verified.
/// @throws InputError if both options are given, or there is no such formula
CubatureFormula choose_formula(std::optional<std::uint64_t> degree, const std::optional<std::string>& formula,
                               std::size_t noise_dimension);

/// The degrees, ascending, for which there is a formula in this dimension, in files or constructed.
std::vector<int> formula_degrees(std::size_t noise_dimension);

/// The formula of Lie polynomials in the file of --formula; nothing if the option is not given or names
/// another kind of formula. @throws InputError as above
std::optional<LieFormula> choose_lie_formula(std::optional<std::uint64_t> degree,
                                             const std::optional<std::string>& formula,
                                             std::size_t noise_dimension);

}  // namespace wienertree::app
