#pragma once
/// Jacobi's diffusion (Forman, Sorensen 2008, "The Pearson diffusions", Scand. J. Statist. 35), whose moments are known.
#include <optional>

#include "wienertree/model/model.hpp"

namespace wienertree {

/// dx = (a + b x) dt + sqrt(c (x - lower)(upper - x)) dB, with a drift that does not lead out of [lower, upper];
/// Wright and Fisher's model without selection is one.
struct JacobiProcess {
  double a = 0, b = 0, c = 1, lower = 0, upper = 1;
};

/// The process, if the model has one state with two bounds and is one: its Ito drift is affine and its variance
/// c (x - lower)(upper - x) at 1001 points between the bounds, to rounding. Several Brownian motions count together.
std::optional<JacobiProcess> jacobi_process(const Model& model);

}  // namespace wienertree
