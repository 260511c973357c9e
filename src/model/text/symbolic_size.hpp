#pragma once
/// Limits on symbolic work. The size of a derivative is known before it is taken: that of a product of m factors has m
/// terms of the product's size, and the derivative of that m times as many again.
#include <cstddef>

#include "wienertree/model/text/location.hpp"
#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

/// Numbers, names and operations of one derivative as it is first written, and of all that a model needs. A model of this
/// size takes some seconds.
inline constexpr double largest_derivative = 1e5, largest_derivatives = 1e6;
/// Entries of the Jacobians of drift and diffusion, (1 + p) d^2.
inline constexpr double most_jacobian_entries = 2e6;

/// Bounds, as trees: an expression's size, and that of its derivative by `x` (0 where it does not depend on x).
struct SymbolicSize {
  double expression = 1, derivative = 0;
};
SymbolicSize symbolic_size(const GiNaC::ex& e, const GiNaC::ex& x);

/// What the derivatives of one model have grown to.
class SymbolicBudget {
 public:
  /// de/dx. @throws InputError at `place`, saying what grew and to what size, where a limit is passed
  GiNaC::ex derivative(const GiNaC::ex& e, const GiNaC::realsymbol& x, const SourceExpression& place);

 private:
  double spent_ = 0;
};

/// @throws InputError for d states and p Brownian motions whose Jacobians are too large
void limit_jacobians(std::size_t d, std::size_t p, const std::string& where);

}  // namespace wienertree::text
