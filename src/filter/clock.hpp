#pragma once
/// The clock of models that depend on t: a state that is known, so that no filter sorts or thins by it.
#include <algorithm>

#include "wienertree/filter/window.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// The clock of every node is `time`, which is the time of the observations: a record that starts at 1871 sees
/// t = 1871. Flows along different paths reach the same time up to rounding only, and a thinning would take the
/// difference for a dimension. Of an input that jumps at this time it is the value after the jump.
inline void set_clock(const Model& model, BatchView states, double time) {
  if (!model.has_clock || states.nodes() == 0) return;
  std::ranges::fill(states.component(model.state_dimension() - 1), model.clock(time));
}

}  // namespace wienertree
