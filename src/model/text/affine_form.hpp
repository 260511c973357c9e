#pragma once
/// Recognising affine expressions, from their structure alone.
#include <optional>

#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {

/// e = linear . x + constant
struct AffineForm {
  Eigen::VectorXd linear;  ///< d
  double constant = 0;
  bool is_constant() const { return (linear.array() == 0.0).all(); }
};

/// The affine form of a bound expression, or nothing when it is not written as one.
std::optional<AffineForm> affine_form(Expression e, std::size_t d);

std::optional<AffineFields> affine_fields(const FieldExpressions& bound);
std::optional<AffineSensor> affine_sensor(const FieldExpressions& bound);

}  // namespace wienertree::text
