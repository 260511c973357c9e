#pragma once
/// Square-root processes found in the coefficients of a model.
#include <string>

#include "wienertree/model/model.hpp"
#include "wienertree/model/square_root.hpp"
#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {

struct SquareRootAnswer {
  std::optional<SquareRootStructure> structure;
  std::string reason;  ///< why there is none
};

/// Looks for a component whose Ito drift is affine in itself and whose noise is proportional to the root of
/// such an expression, and for what is conditionally Gaussian given these. One price at most.
SquareRootAnswer square_root_structure(const FieldExpressions& bound, const Model& model);

/// A line for each component and for the price.
std::vector<std::string> described(const SquareRootStructure& structure, const Model& model);

}  // namespace wienertree::text
