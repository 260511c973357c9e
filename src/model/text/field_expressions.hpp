#pragma once
/// The coefficients of a model as expressions, in both conventions, with the derivatives the program needs.
///
///     V_0 = V~_0 - 1/2 sum_{j,l} V_j^l dV_j/dx_l         (V~_0 the Ito drift, V_0 the Stratonovich drift)
///     (V_r h_i) = sum_l V_r^l dh_i/dx_l,                   [V, W]^i = sum_l V^l dW^i/dx_l - W^l dV^i/dx_l
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "wienertree/model/text/expression.hpp"
#include "wienertree/model/text/model_source.hpp"

namespace wienertree::text {

struct FieldExpressions {
  std::size_t d = 0, p = 0;  ///< d counts the clock
  bool has_clock = false;
  std::vector<Expression> ito_drift;               ///< d
  std::vector<std::vector<Expression>> fields;     ///< V_0 .. V_p (Stratonovich), d entries each
  std::vector<std::vector<Expression>> jacobians;  ///< of V_0 .. V_p; entry i*d + l is dV^i/dx_l
  std::vector<Expression> sensor;                  ///< h, k entries
  std::vector<Expression> sensor_gradient;         ///< entry i*d + l is dh_i/dx_l
  std::vector<Expression> sensor_derivative;       ///< entry i*p + r-1 is V_r h_i
  std::optional<Expression> log_likelihood;
  std::vector<Expression>
      noise_scale;  ///< sd or scale of the noise of each h, 1 where its law has none; k or empty
  std::vector<std::vector<Expression>> correlation;  ///< of the Brownian motions as given; empty: independent
  std::size_t observation_components = 0;            ///< y1 .. yk in `log_likelihood`

  std::size_t sensor_dimension() const { return sensor.size(); }
};

struct Bracket {
  std::size_t i, j;
  std::vector<Expression> components;  ///< of [V_i, V_j], d entries
};

/// A model's expressions and the arena they live in.
struct SymbolicModel {
  std::shared_ptr<Arena> arena;
  FieldExpressions coefficients;  ///< with parameters as symbols
  std::vector<Bracket> brackets;  ///< i < j, when asked for
};

/// `further` fields are brackets of pairs, V_{p+1} = [V_i, V_j] with (i, j) = further[0] and so on, of the
/// model's fields or further ones before it; `coefficients.p` counts them. The values of the parameters decide
/// which columns a correlation of the Brownian motions leaves out (correlation.hpp).
/// @throws InputError naming the place in the source
SymbolicModel derive(const ModelSource& source, const std::vector<double>& parameters, bool with_brackets,
                     const std::vector<std::pair<std::size_t, std::size_t>>& further = {});

/// The coefficients with the parameters replaced by their values.
/// @throws InputError naming the place of a coefficient that is constant and not finite
FieldExpressions substitute(const FieldExpressions& coefficients, const ModelSource& source,
                            const std::vector<double>& parameters, Arena& arena);

/// The values of the parameters in order; `overrides` replaces those it names.
/// @throws InputError for an unknown name in `overrides` or a value that is not finite
std::vector<double> parameter_values(const ModelSource& source,
                                     const std::vector<std::pair<std::string, double>>& overrides);

/// The value of an expression of the parameters. @throws InputError
double constant_value(const SourceExpression& expression, const ModelSource& source,
                      const std::vector<double>& parameters);

/// An expression of the parameters and states, bound. `t` is allowed when `has_clock`. @throws InputError
Expression state_expression(const SourceExpression& expression, const ModelSource& source, bool has_clock,
                            const std::vector<double>& parameters, Arena& arena);

}  // namespace wienertree::text
