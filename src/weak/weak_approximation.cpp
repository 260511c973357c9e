#include "wienertree/weak/weak_approximation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "wienertree/thinning/recombination/recombination.hpp"
#include "wienertree/tree/growth.hpp"
#include "wienertree/tree/tree_size.hpp"
#include "wienertree/weak/journal.hpp"
#include "wienertree/weak/slabs.hpp"

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

class WeakTree {
 public:
  WeakTree(const Model& model, const WeakOptions& options)
      : model_(model),
        options_(options),
        pruned_(options.thinning.method != ThinningMethod::none),
        by_weight_alone_(pruned_ && options.thinning.order == SiteOrder::tree &&
                         !recombines(options.thinning.method)),
        thinning_(pruned_ ? make_thinning(options.thinning) : nullptr),
        grower_(model, options.flow, options.tolerance, options.formula, options.threads) {
    // The discount state is 0 for all, and a clock the same: they are no dimensions to be thinned in.
    const std::size_t dimensions =
        model.reported_dimension() - (options.discount_state ? std::size_t{1} : std::size_t{0});
    directed_ =
        options.finest_along && dimensions > 1 && options.thinning.method == ThinningMethod::recombination;
    if (directed_) drift_flow_ = make_flow(options.flow, model, {1e-4, 1e-6}, 3);
    drift_increments_.assign(1 + model.noise_dimension(), 0.0);
    for (const CubaturePath& path : options.formula.paths) log_lambda_.push_back(std::log(path.weight));
  }

  void plant(const Generation& start) { copy_generation(start, nodes_); }

  void grow() {
    const std::size_t steps = options_.grid.size() - 1;
    while (steps_done_ < steps) {
      const std::size_t j = steps_done_ + 1;
      const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(j),
                                Purpose::path_sampling};
      const bool keeps_all = !pruned_ || nodes_.size() * options_.formula.paths.size() <= options_.nodes;
      if (by_weight_alone_ && !keeps_all)
        step_by_weight(j, random);
      else
        step(j, random, keeps_all || j == steps);
      steps_done_ = j;
      if (options_.observe) options_.observe(j);
    }
  }

  WeakEstimate average_over_leaves(const std::vector<BatchFunction>& payoffs) const {
    WeakEstimate estimate;
    estimate.leaves = nodes_.size();
    estimate.ode_solves = solves();
    estimate.discarded = discarded_;
    std::vector<double> values;
    for (const BatchFunction& payoff : payoffs) {
      estimate.value.push_back(average(payoff, nodes_, values));
      if (!std::isfinite(estimate.value.back()))
        throw RunError(
            fmt::format("the average of payoff {} over the leaves is not finite", estimate.value.size()),
            "payoff", fmt::format("{}", estimate.value.back()));
    }
    return estimate;
  }

  void exchange(StateArchive& archive) {
    std::uint64_t solved = solves();
    archive(steps_done_, nodes_, discarded_, solved);
    if (!archive.reading()) return;
    StateArchive::require(steps_done_ < options_.grid.size() && nodes_.size() > 0 &&
                          nodes_.states.components() == model_.state_dimension() &&
                          nodes_.log_weight.size() == nodes_.size());
    solves_before_ = solved;
  }

 private:
  std::uint64_t solves() const { return solves_before_ + grower_.statistics().node_segments; }
  double length(std::size_t j) const { return options_.grid[j] - options_.grid[j - 1]; }

  void discount(Generation& nodes) const {
    if (!options_.discount_state) return;
    const auto x = nodes.states.component(*options_.discount_state);
    for (std::size_t n = 0; n < nodes.size(); ++n) nodes.log_weight[n] -= std::exchange(x[n], 0.0);
  }

  void require_success(std::size_t j) const {
    if (!failures_.empty())
      throw_node_failure(failures_, model_, fmt::format("step {}, t = {:g}", j, options_.grid[j]));
  }

  void step(std::size_t j, const RandomStream& random, bool keep_all) {
    grower_.grow(nodes_, length(j), children_, failures_);
    require_success(j);
    discount(children_);
    if (keep_all) {
      std::swap(nodes_, children_);
      return;
    }
    if (directed_) {
      look_ahead(options_.grid.back() - options_.grid[j]);
      slabs_.thin(children_, value_, options_.nodes, random, *thinning_, selection_);
    } else {
      thinning_->thin({children_.states, children_.log_weight, nodes_.size(), &grower_.threads()},
                      options_.nodes, random, selection_);
    }
    select(children_, selection_, nodes_, &grower_.threads());
    discarded_ += selection_.discarded;
  }

  // The value at T of what thinning is finest along, each child moved by the drift V_0 alone. It only decides
  // what is near what: a child that cannot be moved so is taken where it is.
  void look_ahead(double remaining) {
    const std::size_t sites = children_.size(), d = children_.states.components();
    ahead_.reshape(d, sites);
    for (std::size_t i = 0; i < d; ++i)
      std::copy_n(children_.states.component(i).begin(), sites, ahead_.component(i).begin());
    drift_increments_[0] = remaining;
    drift_flow_->move(drift_increments_, ahead_, failures_);
    for (const NodeFailure& f : failures_)
      for (std::size_t i = 0; i < d; ++i) ahead_(i, f.node) = children_.states(i, f.node);
    failures_.clear();
    value_.resize(sites);
    options_.finest_along(ahead_, value_);
  }

  void step_by_weight(std::size_t j, const RandomStream& random) {
    const std::size_t parents = nodes_.size(), sites = parents * log_lambda_.size();
    site_weight_.resize(sites);
    for (std::size_t branch = 0; branch < log_lambda_.size(); ++branch)
      for (std::size_t i = 0; i < parents; ++i)
        site_weight_[branch * parents + i] = nodes_.log_weight[i] + log_lambda_[branch];
    const ConstBatchView no_states(nullptr, 0, sites, sites);
    thinning_->thin({no_states, site_weight_, parents, &grower_.threads()}, options_.nodes, random,
                    selection_);
    grower_.grow_chosen(nodes_, length(j), selection_, children_, failures_);
    require_success(j);
    discount(children_);
    std::swap(nodes_, children_);
  }

  const Model& model_;
  const WeakOptions& options_;
  bool pruned_, by_weight_alone_;
  std::unique_ptr<Thinning> thinning_;
  TreeGrower grower_;
  std::vector<double> log_lambda_, site_weight_;
  Generation nodes_, children_;
  Selection selection_;
  bool directed_;
  std::unique_ptr<Flow> drift_flow_;
  std::vector<double> drift_increments_, value_;
  Batch ahead_;
  Slabs slabs_;
  std::vector<NodeFailure> failures_;
  double discarded_ = 0;
  std::size_t steps_done_ = 0;
  std::uint64_t solves_before_ = 0;  ///< of the run whose state was read
};

}  // namespace

WeakEstimate weak_approximation(const Model& model, const Generation& start,
                                const std::vector<BatchFunction>& payoffs, const WeakOptions& options) {
  check(model);
  check_formula_fits(options.formula, model);
  if (options.grid.size() < 2)
    throw InputError("needs at least one step", "grid", std::to_string(options.grid.size()));
  if (options.discount_state && *options.discount_state >= model.state_dimension())
    throw InputError(fmt::format("is not one of {} states", model.state_dimension()), "discount_state",
                     std::to_string(*options.discount_state));
  if (options.nodes == 0) throw InputError("must be at least 1", "nodes", "0");
  if (options.thinning.method == ThinningMethod::none)
    refuse_oversized_tree(options.formula, model, options.grid.size() - 1, options.memory_limit,
                          start.size());
  else
    refuse_oversized_step(options.formula, model, options.nodes, options.memory_limit);
  if (options.thinning.method == ThinningMethod::levelwise)
    require_memory(levelwise_bytes(model.state_dimension(), options.nodes), options.memory_limit,
                   fmt::format("thinning by one patch of {} nodes", options.nodes), "--nodes");
  if (const WeakEstimate* known = options.journal ? options.journal->next() : nullptr) {
    StateArchive::require(known->value.size() == payoffs.size());
    return *known;
  }
  WeakTree tree(model, options);
  tree.plant(start);
  WeakJournal::Growing growing(options.journal, [&tree](StateArchive& archive) { tree.exchange(archive); });
  tree.grow();
  const WeakEstimate estimate = tree.average_over_leaves(payoffs);
  growing.done(estimate);
  return estimate;
}

}  // namespace wienertree
