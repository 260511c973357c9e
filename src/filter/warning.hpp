#pragma once
/// What a filter has seen that makes its answer doubtful, whatever its estimates of error say.
#include <string>
#include <vector>

#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// Each is true without any comparison with other runs.
enum class WarningKind {
  few_atoms,                ///< a law carried by fewer than five effective atoms after an update
  out_of_reach,             ///< an observation beyond the reach of all nodes: (y - predicted)^2 / S above 50
  at_bound,                 ///< mass on a bound, or nodes that were clamped
  drift_leaves_bound,       ///< V_0 points out of a bound
  step_exceeds_relaxation,  ///< a step times the relaxation rate above 1/2
  start_not_represented,    ///< moments of the start to degree 4 are not those of the nodes
  one_family,               ///< the weights of separate modes hang on a single family
  shared_noise,             ///< one Brownian motion drives all components
  unfit_tilt,  ///< a likelihood that one Gaussian, or as many components as there may be, does not fit
};

struct FilterWarning {
  WarningKind kind;
  double time;       ///< when it was first seen
  std::string text;  ///< one sentence with the numbers, without "warning:" and full stop
};

void exchange(StateArchive& archive, FilterWarning& warning);

}  // namespace wienertree
