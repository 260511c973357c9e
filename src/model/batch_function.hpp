#pragma once
/// A real function of the state, evaluated over batches: a payoff, a test function.
#include <functional>
#include <span>

#include "wienertree/model/batch.hpp"

namespace wienertree {

/// out(n) = f(x_n).   x: d x N;  out: N values, no part of x. Thread-safe.
using BatchFunction = std::function<void(ConstBatchView x, std::span<double> out)>;

}  // namespace wienertree
