#pragma once
/// E[f(X_T)] by the iterated KLV operator: the tree of a cubature formula grown along a time grid, thinned or
/// not, and the payoffs averaged over its leaves (Kusuoka 2001; Lyons, Victoir 2004; Litterer, Lyons 2012 for
/// the thinned tree; Ninomiya 2003 for the tree sampled by TBBA).
#include <cstdint>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/formula.hpp"
#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/tree/generation.hpp"
#include "wienertree/tree/thinning.hpp"
#include "wienertree/tree/time_grid.hpp"

namespace wienertree {

struct WeakOptions {
  CubatureFormula formula;   ///< dimension p of the model
  std::vector<double> grid;  ///< from time_grid
  std::size_t nodes = 1000;  ///< N, the budget of the thinning
  ThinningOptions thinning = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  FlowMethod flow = FlowMethod::automatic;
  FlowTolerance tolerance;
  std::uint64_t seed = 1;
  std::uint32_t launch = 0;
  unsigned threads = 1;
  double memory_limit = 4.0e9;  ///< bytes; an unpruned tree over it is refused before it starts
};

struct WeakEstimate {
  std::vector<double> value;     ///< one for each payoff
  std::size_t leaves = 0;        ///< nodes at T that the values are averaged over
  std::uint64_t ode_solves = 0;  ///< node-segments moved
  double discarded = 0;          ///< sum over the steps of Selection::discarded
};

/// One tree, many payoffs. The law of the start is that of the model; `start` below is its first generation.
/// @param payoffs functions of the d states, each with one value a node
/// @throws InputError if an option does not fit the model, or the unpruned tree exceeds the memory limit,
/// with its size and the options that avoid it; RunError naming step, time, node and state when a node cannot
/// be moved
WeakEstimate weak_approximation(const Model& model, const Generation& start,
                                const std::vector<BatchFunction>& payoffs, const WeakOptions& options);

}  // namespace wienertree
