#pragma once
/// Weak approximation to a tolerance: the number of steps, the degree, the nodes and the launches are chosen,
/// and the error is estimated part by part.
#include <span>
#include <string>
#include <vector>

#include "wienertree/weak/run.hpp"

namespace wienertree {

struct WeakTarget {
  double tolerance = 1e-4;  ///< absolute, for every payoff
  /// One a degree at most; the cheapest for the tolerance is taken. One: that one.
  std::vector<CubatureFormula> formulas;
  /// Of other degrees, ascending: one of them is to give the same value before the tolerance counts as
  /// reached. Empty: what two degrees show is missing from the estimate.
  std::vector<CubatureFormula> guards = {};
  bool choose_nodes = true;     ///< or the width of patches; else `options` stay
  bool choose_launches = true;  ///< of a random thinning; else `launches` stays
  bool choose_accuracy = true;  ///< of the flow; else `options.tolerance` stays
  double most_solves = 1e8;     ///< ODEs that all trees together may cost
};

/// Estimates per payoff. Their sum is an estimate of the error, not a bound.
struct WeakErrorSplit {
  double discretisation = 0;  ///< of the steps; with that of smoothing kinks
  double thinning = 0, ode = 0, sampling = 0;
  double total() const { return discretisation + thinning + ode + sampling; }
};

struct ControlledResult {
  std::vector<double> value;           ///< extrapolated from n/2 and n steps
  std::vector<double> standard_error;  ///< of it, over the launches; 0 where nothing is random
  std::vector<WeakErrorSplit> error;
  bool reached = false;            ///< the tolerance, by the estimates and every guard
  std::string limit;               ///< otherwise, what limits the accuracy and what to try
  std::vector<std::string> notes;  ///< on what the guards found and changed
  WeakRun run;                     ///< as chosen
  std::size_t leaves = 0;          ///< of a tree with n steps
  std::uint64_t ode_solves = 0;    ///< of all trees, those for the choices included
};

/// Of X_n, as below.
/// @param V V_n, V_{n/2}, V_{n/4} and, unless n = 4, V_{n/8}
double discretisation_estimate(std::span<const double> V, int degree);

/// X_n is the extrapolation of V_{n/2} and V_n (run_weak), of order above q = (m-1)/2, N the nodes.
/// Estimates:
/// - discretisation: the largest of
///     |X_n - X_{n/2}|, many times the error where the order is seen,
///     |X_{n/2} - X_{n/4}| / 2^{q+2}, half of what this should have fallen to: less may be chance,
///     |V_n - V_{n/2}| |1/(rho - 1) - 1/(2^q - 1)|, where rho = |V_{n/2} - V_{n/4}| / |V_n - V_{n/2}|, at
///       least 5/4: what is left if V converges by the ratio rho that is seen (Aitken 1926) and not by 2^q,
///     4/3 |X_n - Y|, Y the extrapolation by a formula of another degree: of the next higher one at the same n and
///       N; where there is none for this many Brownian motions or it would cost too much, of the next lower one
///       at 2n. Levels of one formula that have all collapsed agree; two formulas do not;
/// - thinning, where it draws nothing: the larger of |X_n(N) - X_n(2N/3)| and |X_{n/2}(N) - X_{n/2}(2N/3)|,
///   or with patches of a given width w the same with 5w/4. A random thinning is unbiased;
/// - sampling: two standard errors of X_n over the launches;
/// - ODE: what a flow a hundred times as accurate changes at 2 steps, times n/2.
/// As long as their sum exceeds e, the steps are doubled, or the nodes increased by half (the patches made
/// narrower by a quarter), or the launches multiplied, where these leave more. The flow's tolerance is
/// tightened first; the formula is the one whose error at 2 steps, taken to fall with its order, promises the
/// least work.
///
/// Before the tolerance counts as reached:
/// - a step is at most half of 1/fastest_rate (dynamics.hpp), as far as the work allows;
/// - at least 8 leaves, or families, carry 99 % of the average of |f|, or 64 steps were made;
/// - in two dimensions and more, recombination to degree 3 (of degree 3: to degree 2) differs by no more than
///   the tolerance;
/// - no bound takes the order (bound_troubles).
/// Work is counted in ODE solves, not clocked. Where it is spent the best value is returned, with `reached`
/// false.
/// @param rungs the same payoffs several times, with kinks smoothed over 2^{1/4} less each time: the first is
/// taken that differs from the next by at most e/4. What smoothing does falls by nearly 2^3 from rung to
/// rung, with a kernel of order 12, and certainly by 4: 4/3 of the difference are all of it; they count as
/// discretisation. One rung: nothing is smoothed
/// @throws InputError if the tolerance is not positive, or there is no formula or rung, or one launch is to
///   show the error of sampling
/// @throws RunError if no tree could be grown
ControlledResult weak_to_tolerance(const Model& model, const std::vector<std::vector<WeakPayoff>>& rungs,
                                   const WeakRun& run, const WeakTarget& target);

}  // namespace wienertree
