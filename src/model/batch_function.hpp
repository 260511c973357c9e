#pragma once
/// A real function of the state, evaluated over batches: a payoff, a test function.
#include <functional>
#include <span>
#include <vector>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// out(n) = f(x_n).   x: d x N;  out: N values, no part of x. Thread-safe.
using BatchFunction = std::function<void(ConstBatchView x, std::span<double> out)>;

/// A function with kinks or jumps: where it is not smooth, an argument passes through 0. Kinks may be nested;
/// what an argument contains comes before it.
struct KinkedFunction {
  BatchFunction exact;
  std::vector<BatchFunction> kinks;  ///< their arguments u_k; none for a smooth function
  /// The function with every kink smoothed over a width h > 0 of its argument's own unit, one a kink.
  std::function<BatchFunction(std::span<const double> widths)> smoothed;
  /// The smooth function that `exact` is where argument k is positive if above[k] = 1, negative if it is 0.
  /// It may be evaluated on the other side as well, and need not be finite there.
  std::function<BatchFunction(std::span<const double> above)> branch;
  /// Argument k in the same sense: the kinks before it replaced by branches.
  std::function<BatchFunction(std::size_t k, std::span<const double> above)> argument_branch;
  /// `exact` with argument k read from a further component of x, the last, instead of the states; empty where
  /// an argument contains another kink.
  std::function<BatchFunction(std::size_t k)> with_argument;
};

}  // namespace wienertree
