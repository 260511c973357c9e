#pragma once
/// Expressions with kinks and jumps as what they are on either side of each.
///
///     max(a, b) = b + [u > 0] u,   min(a, b) = a - [u > 0] u,   u = a - b,
///     |u| = (2 [u > 0] - 1) u,     sign(u) = 2 [u > 0] - 1,     step(u) = [u > 0].
///
/// With a constant 0 or 1 in the place of [u > 0] they are analytic wherever their parts are.
#include <vector>

#include "wienertree/model/text/expression.hpp"

namespace wienertree::text {

/// In `value` and `arguments` [u_k > 0] is the symbol of observation k.
struct Branches {
  Expression value;
  std::vector<Expression> arguments;  ///< u_k, the kinks inside replaced by branches; these come first
  std::vector<Expression> exact;      ///< u_k as it is written; equal ones once
};

/// @pre no parameter or observation occurs in `e`
Branches branches_of(Expression e, Arena& arena);

/// `e` with argument k, `exact` as above, replaced by the symbol of observation 0 wherever a kink has it;
/// the kinks stay.
Expression with_argument(Expression e, Expression exact, Arena& arena);

}  // namespace wienertree::text
