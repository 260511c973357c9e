#pragma once
/// From a model's source and coefficients to the model.
#include "wienertree/model/model.hpp"
#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {

/// All but the exact filter. inputs: null without any. @throws InputError naming the place
Model assemble(const ModelSource& source, const FieldExpressions& bound,
               const std::vector<double>& parameters, std::shared_ptr<const InputFunctions> inputs);

}  // namespace wienertree::text
