#pragma once
/// The arithmetic of a Runge-Kutta step over lanes, compiled for each SIMD width of the machine.
#include <cstddef>
#include <span>

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

struct RungeKuttaKernel {
  /// out = base + h sum_t coefficient_t stage_t.   h: `lanes` values.
  void (*combine)(LaneShape shape, const double* base, const double* h, std::span<const StageTerm> terms,
                  double* out);
  /// squared(lane) = max over components of E^2, with e and e' the sums over `terms` and `low_terms`: E is
  /// |e| / (absolute + relative max(|before|, |after|)), or e^2 / sqrt(e^2 + 0.01 e'^2) scaled alike when
  /// there are low terms. NaN where e, e' or `after` is not finite.
  void (*error)(LaneShape shape, const double* before, const double* after, std::span<const StageTerm> terms,
                std::span<const StageTerm> low_terms, double relative, double absolute, double* squared);
};

/// The widest kernel this machine runs. All of them return the same bits: they are plain IEEE operations in
/// one order.
const RungeKuttaKernel& runge_kutta_kernel();

}  // namespace wienertree
