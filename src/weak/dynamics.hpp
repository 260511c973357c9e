#pragma once
/// What can be seen of a model before any tree is grown that decides how trees must be grown.
#include <string>
#include <vector>

#include "wienertree/model/model.hpp"

namespace wienertree {

/// The fastest rate, per unit of time, at which means relax or grow, or variances grow:
///
///     rho(D V~_0) + rho(sum_j (DV_j)^2),     rho the largest modulus of an eigenvalue,
///
/// which does not depend on the units of the states: the largest of what it is at the start and at four points
/// of the path x' = V~_0(x) up to T. A step must be short against 1/rate: trees of longer steps may agree with
/// each other and all be wrong.
double fastest_rate(const Model& model, double T);

/// Where a bound of a state with `boundary = "clamp"` or "absorb" takes the order of convergence: V_0 leads out
/// of it there (a square root with 4 kappa theta < xi^2), or noise does not vanish on it. Nodes that arrive at
/// the bound are then moved by something that is not the model, and values may converge to a wrong limit.
/// Evaluated with the other states at the start. Harmless where hardly any mass arrives at the bound.
struct BoundTrouble {
  std::size_t state;
  bool upper;          ///< which of its bounds
  double at;           ///< the bound
  std::string reason;  ///< a sentence
};
std::vector<BoundTrouble> bound_troubles(const Model& model);

}  // namespace wienertree
