#include "wienertree/model/text/field_expressions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/model/text/parse_in_place.hpp"

namespace wienertree::text {

namespace {

// The bound value of an expression of the first `count` parameters.
double value_of(const SourceExpression& expression, Symbols& symbols, std::size_t count,
                const std::vector<double>& parameters) {
  Arena arena;
  const GiNaC::ex parsed = parse(expression, {symbols, count, false, false});
  const Expression e = at_place(expression, [&] { return Conversion(symbols, arena)(parsed); });
  return substitute(e, parameters, arena, expression.location.text())->number;
}

}  // namespace

FieldExpressions substitute(const FieldExpressions& coefficients, const ModelSource& source,
                            const std::vector<double>& parameters, Arena& arena) {
  FieldExpressions result = coefficients;
  const auto substitute_all = [&](std::vector<Expression>& list, const auto& place_of) {
    for (std::size_t i = 0; i < list.size(); ++i)
      list[i] = substitute(list[i], parameters, arena, place_of(i).location.text());
  };
  const std::size_t d = coefficients.d;
  substitute_all(result.ito_drift,
                 [&](std::size_t i) -> const SourceExpression& { return source.coefficient(0, i); });
  for (std::size_t k = 0; k <= coefficients.p; ++k) {
    const auto place = [&](std::size_t i) -> const SourceExpression& { return source.coefficient(k, i); };
    substitute_all(result.fields[k], place);
    substitute_all(result.jacobians[k],
                   [&](std::size_t i) -> const SourceExpression& { return place(i / d); });
  }
  const auto& h = source.observation.h;
  substitute_all(result.sensor, [&](std::size_t i) -> const SourceExpression& { return h[i]; });
  substitute_all(result.sensor_gradient, [&](std::size_t i) -> const SourceExpression& { return h[i / d]; });
  substitute_all(result.sensor_derivative,
                 [&](std::size_t i) -> const SourceExpression& { return h[i / coefficients.p]; });
  substitute_all(result.noise_scale, [&](std::size_t i) -> const SourceExpression& {
    const SourceExpression* scale = source.observation.noise_of(i).scale();
    return scale != nullptr ? *scale : h[i];
  });
  if (result.log_likelihood)
    result.log_likelihood = substitute(*result.log_likelihood, parameters, arena,
                                       source.observation.log_likelihood->location.text());
  return result;
}

std::vector<double> parameter_values(const ModelSource& source,
                                     const std::vector<std::pair<std::string, double>>& overrides) {
  const std::vector<std::string> known = names(source.parameters);
  std::vector<const double*> replaced(known.size(), nullptr);
  for (const auto& [name, value] : overrides) {
    const std::string place = Location{source.file, 0, 0, "override of " + name}.text();
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) throw InputError("unknown parameter" + suggestion(name, known), place, name);
    if (!std::isfinite(value)) throw InputError("must be a finite number", place, fmt::format("{}", value));
    replaced[static_cast<std::size_t>(found - known.begin())] = &value;
  }
  const std::lock_guard lock(symbolic_mutex());
  Symbols symbols = symbols_of(source);
  std::vector<double> values;
  for (std::size_t i = 0; i < known.size(); ++i)
    values.push_back(replaced[i] != nullptr ? *replaced[i]
                                            : value_of(source.parameters[i].value, symbols, i, values));
  return values;
}

double constant_value(const SourceExpression& expression, const ModelSource& source,
                      const std::vector<double>& parameters) {
  const std::lock_guard lock(symbolic_mutex());
  Symbols symbols = symbols_of(source);
  return value_of(expression, symbols, parameters.size(), parameters);
}

Expression state_expression(const SourceExpression& expression, const ModelSource& source, bool has_clock,
                            const std::vector<double>& parameters, Arena& arena) {
  const std::lock_guard lock(symbolic_mutex());
  Symbols symbols = symbols_of(source);
  const GiNaC::ex parsed = parse(expression, {symbols, parameters.size(), true, false});
  if (!has_clock && parsed.has(symbols.state(source.states.size())))
    throw InputError("this model does not depend on the time, so that t is not at hand",
                     expression.location.text(), expression.text);
  const Expression e = at_place(expression, [&] { return Conversion(symbols, arena)(parsed); });
  return substitute(e, parameters, arena, expression.location.text());
}

}  // namespace wienertree::text
