#pragma once
/// A signal and its observations, drawn from a model.
#include <cstdint>

#include "wienertree/filter/observations.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

struct Simulation {
  ObservationPath observations;
  ObservationPath signal;  ///< all states (without clock) at the times of the observations
};

/// Euler-Maruyama on `steps` equal steps of [0, horizon]; every `steps/keep`-th step is a row, so that there
/// are keep + 1 rows. Continuous: Y on the same fine grid. Discrete: one draw a row; under timing "previous"
/// of the state one row earlier, and the first row is missing. Without observation, `observations` has no
/// rows.
/// @throws InputError if horizon <= 0, steps = 0, keep = 0 or keep does not divide steps
/// @throws RunError if the signal leaves its bounds or is not finite, naming state and time
Simulation simulate(const Model& model, double horizon, std::size_t steps, std::size_t keep,
                    std::uint64_t seed, std::uint32_t launch = 0);

}  // namespace wienertree
