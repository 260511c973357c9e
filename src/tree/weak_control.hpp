#pragma once
/// Weak approximation to a tolerance: the number of steps, the degree and the nodes are chosen, and the error
/// is estimated part by part.
#include <string>
#include <vector>

#include "wienertree/tree/weak_run.hpp"

namespace wienertree {

/// Payoffs whose kinks are smoothed over `width` standard deviations of their arguments at T, which a tree of
/// degree 3 finds. Kinks whose argument does not vary stay. width = 0: the payoffs as they are.
/// @param model the model itself, whose Brownian motions a formula of degree 3 can drive
/// @throws InputError and RunError as run_weak
std::vector<BatchFunction> smooth_payoffs(const Model& model, const std::vector<KinkedFunction>& payoffs,
                                          double horizon, std::optional<std::size_t> discount_state,
                                          double width);

/// The payoffs with their kinks smoothed over a given width divided by `narrower` >= 1.
using PayoffsByWidth = std::function<std::vector<BatchFunction>(double narrower)>;

struct WeakTarget {
  double tolerance = 1e-4;  ///< absolute, for every payoff
  /// One a degree at most; the cheapest for the tolerance is taken. One: that one.
  std::vector<CubatureFormula> formulas;
  bool choose_nodes = true;     ///< else `options.nodes` stays
  bool choose_accuracy = true;  ///< of the flow; else `options.tolerance` stays
  double most_solves = 1e8;     ///< ODEs that an attempt may cost
};

/// Estimates per payoff. Their sum is an estimate of the error, not a bound.
struct WeakErrorSplit {
  double discretisation = 0;  ///< of the steps; with that of smoothing kinks
  double thinning = 0, ode = 0, sampling = 0;
  double total() const { return discretisation + thinning + ode + sampling; }
};

struct ControlledResult {
  std::vector<double> value;  ///< extrapolated from n/2 and n steps
  std::vector<WeakErrorSplit> error;
  WeakRun run;                   ///< as chosen
  std::size_t leaves = 0;        ///< of the tree with n steps
  std::uint64_t ode_solves = 0;  ///< of all trees, those for the choices included
};

/// X_n is the extrapolation of n/2 and n steps (run_weak), of order above q = (m-1)/2, N the nodes.
/// Estimates:
/// - discretisation |X_n - X_{n/2}| / (2 rho - 1), where rho <= 2^q is the ratio by which the differences of
///   V_{n/4}, V_{n/2}, V_n were seen to fall, 1 if they did not: then nothing is gained by the order;
/// - thinning |X_{n/2}(N) - X_{n/2}(N/2)|: it falls with N and grows with n, at most about as fast;
/// - ODE: what a flow a hundred times as accurate changes at 2 steps, times n/2.
/// As long as their sum exceeds e, the steps or the nodes are doubled, whichever leaves more. The flow's
/// tolerance is tightened first; the formula is the one whose error at 2 steps, taken to fall with its order,
/// promises the least work.
/// Kinks are smoothed over less until that changes a tree of 4 steps by at most e/4; what it changes in the
/// end counts as discretisation.
/// @throws InputError if the tolerance is not positive, there is no formula, or the thinning is random;
/// RunError if the tolerance is not reached, with the estimates that were
ControlledResult weak_to_tolerance(const Model& model, const PayoffsByWidth& payoffs, const WeakRun& run,
                                   const WeakTarget& target);

}  // namespace wienertree
