#include "wienertree/tree/weak_approximation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "wienertree/tree/growth.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {
namespace {

// The weighted sum of a payoff over the leaves, Neumaier-compensated: with 10^7 leaves a plain sum would lose
// three digits.
double average(const BatchFunction& payoff, const Generation& leaves, std::vector<double>& values) {
  values.resize(leaves.size());
  payoff(leaves.states, values);
  double sum = 0, lost = 0;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const double term = std::exp(leaves.log_weight[n]) * values[n], next = sum + term;
    lost += std::abs(sum) >= std::abs(term) ? (sum - next) + term : (term - next) + sum;
    sum = next;
  }
  return sum + lost;
}

}  // namespace

WeakEstimate weak_approximation(const Model& model, const Generation& start,
                                const std::vector<BatchFunction>& payoffs, const WeakOptions& options) {
  check(model);
  check_formula_fits(options.formula, model);
  if (options.grid.size() < 2)
    throw InputError("needs at least one step", "grid", std::to_string(options.grid.size()));
  if (options.nodes == 0) throw InputError("must be at least 1", "nodes", "0");
  const std::size_t steps = options.grid.size() - 1;
  const bool pruned = options.thinning.method != ThinningMethod::none;
  if (!pruned) refuse_oversized_tree(options.formula, model, steps, options.memory_limit);
  const auto thinning = pruned ? make_thinning(options.thinning) : nullptr;
  TreeGrower grower(model, options.flow, options.tolerance, options.formula, options.threads);

  WeakEstimate estimate;
  Generation nodes, children;
  Selection selection;
  std::vector<NodeFailure> failures;
  copy_generation(start, nodes);
  for (std::size_t j = 1; j <= steps; ++j) {
    grower.grow(nodes, options.grid[j] - options.grid[j - 1], children, failures);
    if (!failures.empty())
      throw_node_failure(failures, model, fmt::format("step {}, t = {:g}", j, options.grid[j]));
    if (j == steps || !pruned || children.size() <= options.nodes) {
      std::swap(nodes, children);  // the leaves are averaged over before anything is thinned away
      continue;
    }
    const RandomStream random{options.seed, options.launch, static_cast<std::uint32_t>(j),
                              Purpose::path_sampling};
    thinning->thin({children.states, children.log_weight, nodes.size()}, options.nodes, random, selection);
    select(children, selection, nodes);
    estimate.discarded += selection.discarded;
  }
  estimate.leaves = nodes.size();
  estimate.ode_solves = grower.statistics().node_segments;
  std::vector<double> values;
  for (const BatchFunction& payoff : payoffs) estimate.value.push_back(average(payoff, nodes, values));
  return estimate;
}

}  // namespace wienertree
