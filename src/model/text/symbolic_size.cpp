#include "wienertree/model/text/symbolic_size.hpp"

#include <fmt/format.h>

#include "wienertree/numeric/error.hpp"

namespace wienertree::text {

using GiNaC::ex;

SymbolicSize symbolic_size(const ex& e, const ex& x) {
  if (e.nops() == 0) return {1, e.is_equal(x) ? 1.0 : 0.0};
  SymbolicSize whole;
  const bool sum = GiNaC::is_exactly_a<GiNaC::add>(e);
  double depending = 0;
  for (const ex& part : e) {
    const SymbolicSize size = symbolic_size(part, x);
    whole.expression += size.expression;
    if (!(size.derivative > 0)) continue;
    ++depending;
    whole.derivative += size.derivative;
  }
  // Of a sum, the sum of the derivatives. Else by the product and chain rules: each part that depends on x leaves a term
  // with the others, or with the derivative of the function at the same argument.
  if (depending > 0) whole.derivative += sum ? 1 : depending * (whole.expression + 2);
  return whole;
}

ex SymbolicBudget::derivative(const ex& e, const GiNaC::realsymbol& x, const SourceExpression& place) {
  const SymbolicSize size = symbolic_size(e, x);
  const auto fail = [&](const std::string& message) { throw InputError(message, place.location.text()); };
  if (size.derivative > largest_derivative)
    fail(
        fmt::format("the derivative by {} of an expression of {:.3g} terms and operations (this one, or its "
                    "Ito-Stratonovich correction) has up to {:.3g}, over the limit of {:g}: shorten it, its "
                    "products above all",
                    x.get_name(), size.expression, size.derivative, largest_derivative));
  spent_ += 1 + size.derivative;
  if (spent_ > largest_derivatives)
    fail(fmt::format(
        "with this expression, of {:.3g} terms and operations, the derivatives of the model grow beyond the "
        "limit of {:g} in all",
        size.expression, largest_derivatives));
  return e.diff(x);
}

void limit_jacobians(std::size_t d, std::size_t p, const std::string& where) {
  const double entries = static_cast<double>(1 + p) * static_cast<double>(d) * static_cast<double>(d);
  if (entries <= most_jacobian_entries) return;
  throw InputError(
      fmt::format(
          "{} states and {} Brownian motions make Jacobians of {:.3g} entries, over the limit of {:g}", d, p,
          entries, most_jacobian_entries),
      where);
}

}  // namespace wienertree::text
