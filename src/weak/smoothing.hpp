#pragma once
/// Payoffs with their kinks smoothed on the scale on which the arguments of the kinks vary at T.
#include <optional>
#include <vector>

#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// The standard deviation at T of every kink's argument, by payoff, which a tree of degree 3 finds. A kink
/// whose argument does not vary is given 1e-6 of its value: there it stays as good as sharp.
/// @param model the model itself, whose Brownian motions a formula of degree 3 can drive
/// @throws InputError and RunError as run_weak
std::vector<std::vector<double>> kink_deviations(const Model& model,
                                                 const std::vector<KinkedFunction>& payoffs, double horizon,
                                                 std::optional<std::size_t> discount_state);

/// Kinks smoothed over `width` of their deviations; width = 0: the payoffs as they are.
std::vector<BatchFunction> smooth_payoffs(const std::vector<KinkedFunction>& payoffs,
                                          const std::vector<std::vector<double>>& deviations, double width);

}  // namespace wienertree
