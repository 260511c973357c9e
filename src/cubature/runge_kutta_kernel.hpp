#pragma once
/// The arithmetic of a Runge-Kutta step over lanes, compiled for each SIMD width of the machine.
#include <cstddef>
#include <span>

#include "wienertree/cubature/flow.hpp"

namespace wienertree {

/// One nonzero coefficient and the stage it multiplies.
struct StageTerm {
  const double* stage;  ///< d x `stride`
  double coefficient;
};

/// Arrays are d x stride doubles, component after component; the first `lanes` of each component are
/// computed.
struct LaneShape {
  std::size_t components, stride, lanes;  ///< lanes: a multiple of 16, at most stride
};

/// The result and the two error estimates of a pair, see runge_kutta_pairs.hpp.
struct StepTerms {
  std::span<const StageTerm> b, e, g;
  const double* first_stage;  ///< k_1
  int guard_power;            ///< r
  double guard_weight;        ///< w
};

struct RungeKuttaKernel {
  /// out = base + h sum_t coefficient_t stage_t.   h: `lanes` values.
  void (*combine)(LaneShape shape, const double* base, const double* h, std::span<const StageTerm> terms,
                  double* out);
  /// after = before + h b,   squared(lane) = max(|e|, w |g| (|g| / S)^(r/2 - 1))^2, where b, e, g are the
  /// sums of their terms, and |e|, |g| and S = max(|k_1|, |b|) maxima over the components, each in units of
  /// its tolerance absolute + relative max(|before|, |after|). NaN where anything is not finite.
  void (*finish)(LaneShape shape, const double* before, const double* h, const StepTerms& terms,
                 FlowTolerance tolerance, double* after, double* squared);
};

/// The kernels this machine runs, the widest last. Those with a fused multiply-add (all but the first) return
/// the same bits: they are plain IEEE operations in one order.
std::span<const RungeKuttaKernel> runge_kutta_kernels();

}  // namespace wienertree
