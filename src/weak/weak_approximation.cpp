#include "wienertree/weak/weak_approximation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/thinning/recombination/recombination.hpp"
#include "wienertree/tree/growth.hpp"
#include "wienertree/tree/tree_size.hpp"
#include "wienertree/weak/families.hpp"
#include "wienertree/weak/journal.hpp"
#include "wienertree/weak/slabs.hpp"

namespace wienertree {
namespace {

// As many children are never thinned by width.
constexpr std::size_t few = 32;

class WeakTree {
 public:
  WeakTree(const Model& model, const std::vector<WeakPayoff>& payoffs, const WeakOptions& options)
      : model_(model),
        payoffs_(payoffs),
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
    by_width_ = options.thinning.method == ThinningMethod::recombination;
    on_a_line_ = by_width_ && options.patch_width > 0 && dimensions == 1;
    for (const WeakPayoff& payoff : payoffs) kinks_ = kinks_ || !payoff.function.kinks.empty();
    by_time_ = std::all_of(payoffs.begin(), payoffs.end(), [](const auto& f) { return !f.at_times.empty(); });
    two_steps_ = kinks_ && options.formula.degree <= 5 && options.formula.paths.size() <= 16;
    drift_increments_.assign(1 + model.noise_dimension(), 0.0);
    for (const CubaturePath& path : options.formula.paths) log_lambda_.push_back(std::log(path.weight));
  }

  void plant(const Generation& start) {
    copy_generation(start, nodes_);
    if (model_.inputs) std::ranges::fill(nodes_.states.component(model_.state_dimension() - 1), clock_at(0));
    if (model_.has_clock && !model_.inputs)
      clock_ = nodes_.states(model_.state_dimension() - 1, 0) - options_.grid.front();
  }

  void grow() {
    const std::size_t steps = options_.grid.size() - 1;
    while (steps_done_ < steps) {
      const std::size_t j = steps_done_ + 1;
      const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(j),
                                Purpose::path_sampling};
      const std::size_t children = nodes_.size() * options_.formula.paths.size();
      const bool keeps_all = !pruned_ || children <= (on_a_line_ ? few : options_.nodes);
      // The last step need not be made where its leaves were averaged over with the step before.
      if (estimate_.value.size() < expected_values()) {
        if (by_weight_alone_ && !keeps_all && !averages_families(j))
          step_by_weight(j, random);
        else
          step(j, random, keeps_all || j == steps);
      }
      steps_done_ = j;
      if (options_.observe) options_.observe(j);
    }
  }

  WeakEstimate estimate() const {
    WeakEstimate result = estimate_;
    result.ode_solves = solves();
    result.discarded = discarded_;
    return result;
  }

  void exchange(StateArchive& archive) {
    std::uint64_t solved = solves();
    archive(steps_done_, nodes_, discarded_, solved, estimate_.value, estimate_.carriers, estimate_.leaves);
    if (!archive.reading()) return;
    StateArchive::require(steps_done_ < options_.grid.size() && nodes_.size() > 0 &&
                          nodes_.states.components() == model_.state_dimension() &&
                          nodes_.log_weight.size() == nodes_.size());
    solves_before_ = solved;
  }

 private:
  std::uint64_t solves() const { return solves_before_ + grower_.statistics().node_segments + moved_; }
  double length(std::size_t j) const { return options_.grid[j] - options_.grid[j - 1]; }

  std::size_t expected_values() const {
    return payoffs_.size() * std::max<std::size_t>(1, options_.report_at.size());
  }
  bool reports(std::size_t j) const {
    if (options_.report_at.empty()) return j + 1 == options_.grid.size();
    return std::binary_search(options_.report_at.begin(), options_.report_at.end(), j);
  }

  // Whether families of leaves are averaged over that step j makes: all of its children are needed.
  bool averages_families(std::size_t j) const {
    return kinks_ && (reports(j) || (two_steps_ && j + 1 < options_.grid.size() && reports(j + 1)));
  }

  // Averages over leaves at the end of step j, in families of the nodes `parents` of one generation.
  void report(std::size_t j, const Generation& leaves, std::size_t parents) {
    estimate_.leaves = leaves.size();
    const std::size_t time = estimate_.value.size() / payoffs_.size();
    std::optional<FamilyAverage> families;
    for (std::size_t i = 0; i < payoffs_.size(); ++i) {
      const KinkedFunction& f = payoffs_[i].function;
      LeafAverage average;
      if (!payoffs_[i].at_times.empty()) {
        average = average_over(payoffs_[i].at_times[time], leaves);
      } else if (f.kinks.empty() || parents == 0) {
        average = average_over(f.exact, leaves);
      } else {
        if (!families) families.emplace(leaves, parents, options_.formula.degree >= 7);
        average = (*families)(f);
      }
      estimate_.value.push_back(average.value * std::exp(-payoffs_[i].discount_rate * options_.grid[j]));
      estimate_.carriers.push_back(average.carriers);
      if (!std::isfinite(estimate_.value.back()))
        throw RunError(fmt::format("the average of payoff {} over the leaves is not finite", i + 1), "payoff",
                       fmt::format("{}", estimate_.value.back()));
    }
  }

  // At the end of step j: of inputs that jump there the values after the jump.
  double clock_at(std::size_t j) const {
    return model_.inputs ? model_.clock(options_.grid[j]) : clock_ + options_.grid[j];
  }

  // What is the same for all nodes at a time must not come to differ by rounding.
  void settle(Generation& nodes, std::size_t j) const {
    if (model_.has_clock) {
      const auto clock = nodes.states.component(model_.state_dimension() - 1);
      std::fill(clock.begin(), clock.end(), clock_at(j));
    }
    if (!options_.discount_state) return;
    const auto x = nodes.states.component(*options_.discount_state);
    for (std::size_t n = 0; n < nodes.size(); ++n) nodes.log_weight[n] -= std::exchange(x[n], 0.0);
  }

  // The standard deviation of each component over the next step, by the diffusion at each child.
  void find_deviations(std::size_t j) {
    const std::size_t d = model_.state_dimension(), p = model_.noise_dimension(), sites = children_.size();
    diffusion_.reshape(d * p, sites);
    deviation_.reshape(d, sites);
    model_.fields->diffusion(children_.states, diffusion_);
    const double root = std::sqrt(length(std::min(j + 1, options_.grid.size() - 1)));
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < sites; ++n) {
        double square = 0;
        for (std::size_t k = 0; k < p; ++k) square += diffusion_(i * p + k, n) * diffusion_(i * p + k, n);
        deviation_(i, n) = root * std::sqrt(square);
      }
    if (options_.transition) scale_integrals();
  }

  // What an exact transition carries without noise are integrals of variances: the law of a price given I has a
  // variance in proportion to it, so that averages vary with I on a relative scale, down to half of its mean.
  void scale_integrals() {
    for (std::size_t i = 0; i < children_.states.components(); ++i) {
      const auto deviation = deviation_.component(i);
      if (*std::max_element(deviation.begin(), deviation.end()) > 0) continue;
      const auto I = children_.states.component(i);
      double sum = 0, mass = 0;
      for (std::size_t n = 0; n < children_.size(); ++n) {
        const double w = std::exp(children_.log_weight[n]);
        sum += w * std::abs(I[n]);
        mass += w;
      }
      for (std::size_t n = 0; n < children_.size(); ++n) deviation[n] = std::abs(I[n]) + 0.5 * sum / mass;
    }
  }

  void require_success(std::size_t j) const {
    if (!failures_.empty())
      throw_node_failure(failures_, model_, fmt::format("step {}, t = {:g}", j, options_.grid[j]));
  }

  // All children of all nodes.
  void move(const Generation& parents, double s, Generation& children, std::vector<NodeFailure>& failures) {
    if (!options_.transition) return grower_.grow(parents, s, children, failures);
    failures.clear();
    options_.transition->grow(parents, options_.formula.degree, s, &grower_.threads(), children);
    moved_ += children.size();
  }

  void step(std::size_t j, const RandomStream& random, bool keep_all) {
    move(nodes_, length(j), children_, failures_);
    require_success(j);
    settle(children_, j);
    const std::size_t parents = nodes_.size();
    // Payoffs with a price integrated out are smooth, and cost more than a step: they see what thinning leaves.
    const bool thinned_first = reports(j) && by_time_ && pruned_ && children_.size() > options_.nodes;
    if (reports(j) && !thinned_first && !(two_steps_ && j > 1)) report(j, children_, parents);
    if (two_steps_ && j + 1 < options_.grid.size() && reports(j + 1)) {
      move(children_, length(j + 1), grandchildren_, failures_);
      require_success(j + 1);
      settle(grandchildren_, j + 1);
      report(j + 1, grandchildren_, parents);
    }
    if (keep_all && !thinned_first) {
      std::swap(nodes_, children_);
      return;
    }
    if (by_width_) find_deviations(j);
    if (directed_) {
      look_ahead(options_.grid.back() - options_.grid[j]);
      slabs_.thin(children_, value_, options_.nodes, random, *thinning_, selection_,
                  by_width_ ? ConstBatchView(deviation_) : ConstBatchView());
    } else {
      Sites sites{children_.states, children_.log_weight, parents, &grower_.threads()};
      if (by_width_) sites.deviation = deviation_;
      sites.width = options_.patch_width;
      thinning_->thin(sites, options_.nodes, random, selection_);
    }
    select(children_, selection_, nodes_, &grower_.threads());
    discarded_ += selection_.discarded;
    if (thinned_first) report(j, nodes_, 0);
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
    settle(children_, j);
    if (reports(j)) report(j, children_, 0);
    std::swap(nodes_, children_);
  }

  const Model& model_;
  const std::vector<WeakPayoff>& payoffs_;
  const WeakOptions& options_;
  bool pruned_, by_weight_alone_;
  bool kinks_ = false;      ///< some payoff has them
  bool by_time_ = false;    ///< all have a function for each time
  bool two_steps_ = false;  ///< families are those of the last two steps
  bool on_a_line_ = false;  ///< patches have a given width, whatever the budget
  bool by_width_ = false;   ///< thinning looks at local standard deviations
  double clock_ = 0;        ///< at t = 0, without inputs
  WeakEstimate estimate_;
  std::unique_ptr<Thinning> thinning_;
  TreeGrower grower_;
  std::vector<double> log_lambda_, site_weight_;
  Generation nodes_, children_, grandchildren_;
  Batch diffusion_, deviation_;
  Selection selection_;
  bool directed_;
  std::unique_ptr<Flow> drift_flow_;
  std::vector<double> drift_increments_, value_;
  Batch ahead_;
  Slabs slabs_;
  std::vector<NodeFailure> failures_;
  double discarded_ = 0;
  std::size_t steps_done_ = 0;
  std::uint64_t moved_ = 0;          ///< children by a transition
  std::uint64_t solves_before_ = 0;  ///< of the run whose state was read
};

}  // namespace

namespace {

// Inputs are known on the grid, and jump at points of it alone.
void check_inputs(const InputFunctions& inputs, const std::vector<double>& grid) {
  inputs.require_span(grid.front(), grid.back(), "the steps");
  for (const double jump : inputs.jumps()) {
    if (!(jump > grid.front() && jump < grid.back())) continue;
    const auto after = std::ranges::lower_bound(grid, jump);
    const double apart = std::min(*after - jump, jump - *(after - 1));
    if (apart > 8 * std::numeric_limits<double>::epsilon() * std::abs(jump))
      throw InputError("a step must end where an input jumps", "grid", fmt::format("t = {}", jump));
  }
}

}  // namespace

WeakEstimate weak_approximation(const Model& model, const Generation& start,
                                const std::vector<WeakPayoff>& payoffs, const WeakOptions& options) {
  check(model);
  check_formula_fits(options.formula, model);
  if (options.grid.size() < 2)
    throw InputError("needs at least one step", "grid", std::to_string(options.grid.size()));
  if (options.discount_state && *options.discount_state >= model.state_dimension())
    throw InputError(fmt::format("is not one of {} states", model.state_dimension()), "discount_state",
                     std::to_string(*options.discount_state));
  if (options.nodes == 0) throw InputError("must be at least 1", "nodes", "0");
  if (model.inputs) check_inputs(*model.inputs, options.grid);
  for (const WeakPayoff& payoff : payoffs)
    if (!payoff.at_times.empty() &&
        payoff.at_times.size() != std::max<std::size_t>(1, options.report_at.size()))
      throw InputError("needs a function for each time to report at", "payoff",
                       std::to_string(payoff.at_times.size()));
  if (options.transition && options.thinning.order == SiteOrder::tree && !recombines(options.thinning.method))
    throw InputError("needs a thinning that looks at states", "transition");
  if (options.thinning.method == ThinningMethod::none)
    refuse_oversized_tree(options.formula, model, options.grid.size() - 1, options.memory_limit,
                          start.size());
  else
    refuse_oversized_step(options.formula, model, options.nodes, options.memory_limit);
  if (options.thinning.method == ThinningMethod::levelwise)
    require_memory(levelwise_bytes(model.state_dimension(), options.nodes), options.memory_limit,
                   fmt::format("thinning by one patch of {} nodes", options.nodes), "--nodes");
  if (const WeakEstimate* known = options.journal ? options.journal->next() : nullptr) {
    StateArchive::require(known->value.size() ==
                          payoffs.size() * std::max<std::size_t>(1, options.report_at.size()));
    return *known;
  }
  WeakTree tree(model, payoffs, options);
  tree.plant(start);
  WeakJournal::Growing growing(options.journal, [&tree](StateArchive& archive) { tree.exchange(archive); });
  tree.grow();
  const WeakEstimate estimate = tree.estimate();
  growing.done(estimate);
  return estimate;
}

}  // namespace wienertree
