#pragma once
/// A real function of the state, evaluated over batches: a payoff, a test function.
#include <functional>
#include <span>
#include <vector>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// out(n) = f(x_n).   x: d x N;  out: N values, no part of x. Thread-safe.
using BatchFunction = std::function<void(ConstBatchView x, std::span<double> out)>;

/// A function with kinks: where it is not differentiable, an argument passes through 0.
struct KinkedFunction {
  BatchFunction exact;
  std::vector<BatchFunction> kinks;  ///< their arguments; none for a smooth function
  /// The function with every kink smoothed over a width h > 0 of its argument's own unit, one a kink.
  std::function<BatchFunction(std::span<const double> widths)> smoothed;
};

}  // namespace wienertree
