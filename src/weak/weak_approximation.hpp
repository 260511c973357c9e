#pragma once
/// E[f(X_T)] by the iterated KLV operator: the tree of a cubature formula grown along a time grid, thinned or
/// not, and the payoffs averaged over its leaves (Kusuoka 2001; Lyons, Victoir 2004; Litterer, Lyons 2012 for
/// the thinned tree; Ninomiya 2003, "A partial sampling method applied to the Kusuoka approximation", for the
/// tree sampled by TBBA).
#include <concepts>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/formula.hpp"
#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/thinning/thinning.hpp"
#include "wienertree/tree/generation.hpp"
#include "wienertree/tree/time_grid.hpp"
#include "wienertree/tree/transition.hpp"

namespace wienertree {

class WeakJournal;

/// What is averaged. With kinks it is averaged family by family (families.hpp), else leaf by leaf.
struct WeakPayoff {
  KinkedFunction function;
  double discount_rate = 0;  ///< values are multiplied by exp(-discount_rate t)
  /// One for each time to report at, instead of `function`, where it is not the same at all times; or empty.
  std::vector<BatchFunction> at_times = {};

  template <class F>
  requires std::constructible_from<BatchFunction, F> WeakPayoff(F smooth)
      : function{BatchFunction(std::move(smooth)), {}, {}, {}, {}, {}} {}
  explicit WeakPayoff(KinkedFunction kinked) : function(std::move(kinked)) {}
};

struct WeakOptions {
  CubatureFormula formula;   ///< dimension p of the model
  std::vector<double> grid;  ///< from time_grid
  std::size_t nodes = 1000;  ///< N, the budget of the thinning; `none` has no use for it
  ThinningOptions thinning = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  /// Width of the patches of a recombination in units of the local one-step standard deviation, where one
  /// component varies; as few as fit into N nodes where that is less. 0: as many as fit.
  double patch_width = 0;
  /// Steps after which the payoffs are averaged, ascending; empty: after the last.
  std::vector<std::size_t> report_at = {};
  /// What the payoffs bend along, the argument of a kink, say; may be empty. In two dimensions and more
  /// recombination is then finest along its value at T on the path without noise (slabs.hpp).
  BatchFunction finest_along = {};
  /// Moves nodes instead of the formula's paths, as well as its degree asks for; may be null. Not with a random
  /// thinning in tree order.
  std::shared_ptr<const TransitionRule> transition = {};
  FlowMethod flow = FlowMethod::automatic;
  FlowTolerance tolerance;
  std::uint64_t seed = 1;
  std::uint32_t launch = 0;
  unsigned threads = 1;
  /// A component that is int r dt along the path: values are those of exp(-int_0^T r dt) f(X_T). After each
  /// step exp(-x) becomes part of the node's weight and x starts again from 0, so that thinning sees the
  /// discounted measure (Feynman-Kac) and no further dimension.
  std::optional<std::size_t> discount_state = {};
  double memory_limit = wienertree::memory_limit();  ///< bytes; a tree over it is refused before it starts
  /// Called after each step with its number, from 1; may be empty. What it throws ends the computation.
  std::function<void(std::size_t step)> observe = {};
  /// Where the trees of the computation are recorded, to be put down and taken up; may be null.
  WeakJournal* journal = nullptr;
};

struct WeakEstimate {
  std::vector<double> value;  ///< one for each payoff, time by time where there are several
  /// Leaves, or families of leaves, that carry 99 % of the average of each payoff's modulus; at most 64
  /// are counted.
  std::vector<std::size_t> carriers;
  std::size_t leaves = 0;        ///< nodes at T that the values are averaged over
  std::uint64_t ode_solves = 0;  ///< node-segments moved
  double discarded = 0;          ///< sum over the steps of Selection::discarded
};

void exchange(StateArchive& archive, WeakEstimate& estimate);

/// One tree, many payoffs. The law of the start is that of the model; `start` is its first generation.
///
/// While a step has at most N children they are all kept. Beyond that, a random thinning in tree order looks
/// at weights alone: it chooses among the children before any is moved, so that a step costs N moves. All
/// others look at states: a step costs N c moves, c the paths of the formula, and the children of the last
/// step are averaged over as they are. Where a payoff has kinks, all children of the last step are moved, and
/// for a formula of degree 5 or less, with at most 16 paths, those of the last two.
/// A clock is the same for all nodes: it is set, not integrated, and is no dimension to be thinned in.
/// @param payoffs functions of the d states, each with one value a node
/// @throws InputError if an option does not fit the model, or the tree exceeds the memory limit, with its
/// size and the options that avoid it; RunError naming step, time, node and state when a node cannot be
/// moved, and naming the payoff when its average is not finite
WeakEstimate weak_approximation(const Model& model, const Generation& start,
                                const std::vector<WeakPayoff>& payoffs, const WeakOptions& options);

}  // namespace wienertree
