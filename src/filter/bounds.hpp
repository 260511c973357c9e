#pragma once
/// Bounds of the state for particles that are moved by random numbers.
#include "wienertree/filter/window.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// Moves particles to the bounds that clamp or absorb. x: d x count, particles first .. first+count-1.
/// @throws RunError naming step, particle and state if one is outside a bound that does neither, or not
/// finite
void keep_inside_bounds(const Model& model, const ObservationWindow& window, std::size_t first, BatchView x);

}  // namespace wienertree
