#pragma once
/// How the kinks of payoffs are treated, and payoffs with their kinks smoothed on the scale on which the
/// arguments of the kinks vary at T.
#include <optional>
#include <vector>

#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/weak/weak_approximation.hpp"

namespace wienertree {

/// The argument u of a kink at T, as a tree of degree 3 finds it.
struct KinkScale {
  /// Standard deviation. Of an argument that does not vary, 1e-6 of its value: there a kink that is smoothed
  /// stays as good as sharp.
  double deviation = 0;
  /// T E |grad u . V|^2 over the variance of u, the directions V_1..V_p summed over: how much of the
  /// variance one step would make if all steps went on like it. 0 for an integral over time.
  double spread = 0;
};

/// By payoff and kink.
/// @param model the model itself, whose Brownian motions a formula of degree 3 can drive
/// @throws InputError and RunError as run_weak
std::vector<std::vector<KinkScale>> kink_scales(const Model& model,
                                                const std::vector<KinkedFunction>& payoffs, double horizon,
                                                std::optional<std::size_t> discount_state);

/// Whether the law of the last step smooths the kinks of a payoff: the noise of one step spreads every
/// argument over a fair part of what separates the nodes. Below a spread of 1/50 it does not, and the kinks
/// must be smoothed by a kernel.
bool last_step_smooths(const std::vector<KinkScale>& scales);

/// Kinks smoothed over `width` of their deviations; width = 0: sharp.
BatchFunction smooth_payoff(const KinkedFunction& payoff, const std::vector<KinkScale>& scales, double width);

}  // namespace wienertree
