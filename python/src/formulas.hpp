#pragma once
/// Formulas where Python may give one by name, by file or itself.
#include <pybind11/pybind11.h>

#include <optional>

#include "wienertree/cubature/formula.hpp"

namespace wienertree::python {

/// Takes a Formula out of the keyword arguments, if `formula` is one and not the name of one.
std::optional<CubatureFormula> take_formula(pybind11::dict& options);

/// @throws InputError unless the formula is verified, and for as many Brownian motions as the model has
void require_usable(const CubatureFormula& formula, std::size_t noise_dimension);

}  // namespace wienertree::python
