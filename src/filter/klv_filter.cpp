#include "wienertree/filter/klv_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/filter/places.hpp"
#include "wienertree/tree/initial.hpp"
#include "wienertree/tree/log_weights.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 1024;  ///< nodes a task: their sensor values stay in cache

}  // namespace

KlvFilter::KlvFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      functional_(make_functional(options)),
      thinning_(options.thinning.method == ThinningMethod::none ? nullptr : make_thinning(options.thinning)),
      grower_(model_, options_.flow, options_.tolerance, options_.formula, options_.threads),
      survivors_(first_generation(model_, options_.nodes)),
      current_(&survivors_),
      child_sensor_(options_.threads) {
  if (carries_likelihood()) survivors_.log_likelihood.assign(survivors_.size(), 0.0);
}

std::string_view KlvFilter::name() const { return thinning_ ? "klv" : "full-tree"; }

// For good, or until their effective sample size asks that they decide.
bool KlvFilter::carries_likelihood() const {
  return options_.prune_weights == PruneWeights::cubature || (thinning_ && options_.ess_threshold < 1);
}

// The part of the weight that observations go to.
std::vector<double>& KlvFilter::likelihood_of(Generation& g) const {
  return carries_likelihood() ? g.log_likelihood : g.log_weight;
}

void KlvFilter::advance(const ObservationWindow& window) {
  observe_start(window);
  if (window.length() > 0) {
    grow(window);
    weigh(window);
  }
  check_weights(likelihood_of(window.length() > 0 ? children_ : survivors_), window);
  if (window.length() > 0) thin(window);
  ++statistics_.steps;
  time_ = window.end;
  stale_ = true;
}

// Whatever depends on the nodes at the window's start: an observation there, and the functional's first term.
void KlvFilter::observe_start(const ObservationWindow& window) {
  const bool here = window.at_start || window.length() == 0;
  if (model_.observation == ObservationKind::discrete && here && !window.observation.empty()) {
    start_term_.resize(survivors_.size());
    model_.density->log_density(window.observation, survivors_.states, start_term_);
    std::vector<double>& weight = likelihood_of(survivors_);
    for (std::size_t n = 0; n < survivors_.size(); ++n) weight[n] += start_term_[n];
    current_ = &survivors_;
  }
  if (model_.observation != ObservationKind::continuous) return;
  const std::size_t k = model_.fields->sensor_dimension(), p = model_.noise_dimension();
  sensor_.reshape(k, survivors_.size());
  derivative_.reshape(functional_->uses_derivative() ? k * p : 0, survivors_.size());
  start_term_.resize(survivors_.size());
  for_blocks(
      &grower_.threads(), survivors_.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
        const ConstBatchView x = std::as_const(survivors_.states).view().nodes(first, count);
        const BatchView h0 = sensor_.view().nodes(first, count), G = derivative_.view().nodes(first, count);
        model_.fields->sensor(x, h0);
        if (functional_->uses_derivative()) model_.fields->sensor_derivative(x, G);
        functional_->at_start(window, h0, G, std::span(start_term_).subspan(first, count));
      });
}

void KlvFilter::grow(const ObservationWindow& window) {
  grower_.grow(survivors_, window.length(), children_, failures_);
  children_.time = window.end;
  current_ = &children_;
  statistics_.children += children_.size();
  statistics_.flow = flow_before_;
  statistics_.flow += grower_.statistics();
  if (!failures_.empty()) handle_failures(window);
}

void KlvFilter::handle_failures(const ObservationWindow& window) {
  // Where every node fails, none is left to stand for those that are dropped.
  if (options_.on_node_failure == OnNodeFailure::stop || failures_.size() == children_.size())
    throw_node_failure(failures_, model_, place(window));
  for (const NodeFailure& f : failures_) {
    // A dropped node has no mass; its state is its parent's, so that nothing downstream meets a NaN.
    children_.log_weight[f.node] = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < children_.states.components(); ++i)
      children_.states(i, f.node) = survivors_.states(i, children_.parent[f.node]);
  }
  statistics_.dropped_nodes += failures_.size();
  failures_.clear();
}

void KlvFilter::weigh(const ObservationWindow& window) {
  const std::size_t parents = survivors_.size();
  std::vector<double>& weight = likelihood_of(children_);
  if (model_.observation == ObservationKind::discrete) {
    if (window.at_start || window.observation.empty()) return;
    term_.resize(children_.size());
    model_.density->log_density(window.observation, children_.states, term_);
    for (std::size_t n = 0; n < children_.size(); ++n) weight[n] += term_[n];
    return;
  }
  if (model_.observation == ObservationKind::none) return;
  // Tasks are blocks of one branch each.
  const std::size_t blocks = (parents + block - 1) / block;
  for (Batch& scratch : child_sensor_) scratch.reshape(sensor_.components(), std::min(block, parents));
  grower_.threads().for_each(options_.formula.paths.size() * blocks, [&](std::size_t task,
                                                                         std::size_t thread) {
    const std::size_t first = task % blocks * block, count = std::min(block, parents - first);
    const std::size_t child = task / blocks * parents + first;
    const std::span<double> w = {weight.data() + child, count};
    for (std::size_t n = 0; n < count; ++n) w[n] += start_term_[first + n];
    if (!functional_->uses_end()) return;
    const BatchView h1 = child_sensor_[thread].view().nodes(0, count);
    model_.fields->sensor(children_.states.view().nodes(child, count), h1);
    const BatchView G = functional_->uses_derivative() ? derivative_.view().nodes(first, count) : BatchView{};
    functional_->at_end(window, sensor_.view().nodes(first, count), G, h1, w);
  });
}

// As check_log_weights, which is asked only where something is wrong.
void KlvFilter::check_weights(std::span<const double> log_weight, const ObservationWindow& window) {
  std::atomic<bool> valid = true, positive = false;
  for_blocks(&grower_.threads(), log_weight.size(), 16 * block,
             [&](std::size_t first, std::size_t count, std::size_t) {
               const auto [largest, all_valid] = largest_log_weight(log_weight.subspan(first, count));
               if (!all_valid) valid = false;
               if (largest > -std::numeric_limits<double>::infinity()) positive = true;
             });
  if (!valid || !positive) check_log_weights(log_weight, window);
}

void KlvFilter::thin(const ObservationWindow& window) {
  if (!thinning_ || children_.size() <= options_.nodes) {
    copy_generation(children_, survivors_);
    return;
  }
  let_likelihoods_decide_if_due();
  const Sites sites{children_.states, children_.log_weight, survivors_.size(), &grower_.threads()};
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::thinning};
  try {
    thinning_->thin(sites, options_.nodes, random, selection_);
  } catch (const RunError& e) {
    throw RunError(e.message(), place_and_observation(window), e.value());
  }
  select(children_, selection_, survivors_, &grower_.threads());
  statistics_.discarded += selection_.discarded;
}

// Effective sample size of likelihoods L under the tree's weights q, relative to that of equal ones:
// (sum q L)^2 / (sum q sum q L^2).
void KlvFilter::let_likelihoods_decide_if_due() {
  if (!carries_likelihood() || options_.prune_weights == PruneWeights::cubature) return;
  std::vector<double>&q = children_.log_weight, &L = children_.log_likelihood;
  const double largest_q = *std::max_element(q.begin(), q.end());
  const double largest_L = *std::max_element(L.begin(), L.end());
  double mass = 0, sum = 0, squares = 0;
  for (std::size_t n = 0; n < q.size(); ++n) {
    const double weight = std::exp(q[n] - largest_q), likelihood = std::exp(L[n] - largest_L);
    mass += weight;
    sum += weight * likelihood;
    squares += weight * likelihood * likelihood;
  }
  // Not a number, and nothing but zeros, go on to the thinning, which refuses them.
  if (sum * sum > options_.ess_threshold * mass * squares) return;
  for (std::size_t n = 0; n < q.size(); ++n) q[n] += std::exchange(L[n], 0.0);
}

void KlvFilter::exchange_state(StateArchive& archive) {
  Generation& g = survivors_;
  archive(g, time_);
  StateArchive::require(g.states.components() == model_.state_dimension() && g.size() > 0 &&
                        g.log_weight.size() == g.size() &&
                        g.log_likelihood.size() == (carries_likelihood() ? g.size() : 0));
  if (!archive.reading()) return;
  flow_before_ = statistics_.flow;
  current_ = &survivors_;
  stale_ = true;
}

const Posterior& KlvFilter::posterior() {
  if (stale_) normalised_.assign(current_->log_weight, current_->log_likelihood, statistics_.steps, time_);
  stale_ = false;
  posterior_.time = time_;
  posterior_.log_evidence = normalised_.log_mass;
  posterior_.points = current_->states;
  posterior_.weight = normalised_.weight;
  posterior_.parents = current_ == &children_ ? children_.size() / options_.formula.paths.size() : 0;
  posterior_.kept = survivors_.size();
  return posterior_;
}

}  // namespace wienertree
