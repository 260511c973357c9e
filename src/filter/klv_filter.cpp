#include "wienertree/filter/klv_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/filter/clock.hpp"
#include "wienertree/filter/node_warnings.hpp"
#include "wienertree/filter/places.hpp"
#include "wienertree/numeric/log_weights.hpp"
#include "wienertree/tree/initial.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {

// The likelihood of the window, given to every child while it is in cache.
class KlvFilter::Weigher final : public FamilyVisitor {
 public:
  Weigher(KlvFilter& filter, const ObservationWindow& window)
      : filter_(filter),
        model_(filter.model_),
        window_(window),
        weight_(filter.likelihood_of(filter.children_)) {}

  void parents(std::size_t first, std::size_t count, std::size_t thread) override {
    if (model_.observation != ObservationKind::continuous) return;
    const Functional& functional = *filter_.functional_;
    const std::size_t k = model_.fields->sensor_dimension(), p = model_.noise_dimension();
    Scratch& s = filter_.scratch_[thread];
    s.sensor.reshape(k, count);
    s.derivative.reshape(functional.uses_derivative() ? k * p : 0, count);
    s.term.resize(count);
    const ConstBatchView x = std::as_const(filter_.survivors_.states).view().nodes(first, count);
    model_.fields->sensor(x, s.sensor);
    if (functional.uses_derivative()) model_.fields->sensor_derivative(x, s.derivative);
    functional.at_start(window_, s.sensor, s.derivative, s.term);
  }

  void children(std::size_t, std::size_t child, std::size_t count, std::size_t thread) override {
    const std::span<double> w = std::span(weight_).subspan(child, count);
    // An observation sees the input that begins at its time; the functional of a path what the step ends with.
    if (model_.inputs && model_.observation == ObservationKind::discrete)
      set_clock(model_, filter_.children_.states.view().nodes(child, count), window_.end);
    const ConstBatchView x = std::as_const(filter_.children_.states).view().nodes(child, count);
    if (model_.observation == ObservationKind::continuous) weigh_continuous(x, w, filter_.scratch_[thread]);
    if (model_.observation == ObservationKind::discrete) weigh_discrete(x, w, filter_.scratch_[thread]);
    const LargestLogWeight largest = largest_log_weight(w);
    if (!largest.all_valid) valid_.store(false, std::memory_order_relaxed);
    if (largest.value > -std::numeric_limits<double>::infinity())
      positive_.store(true, std::memory_order_relaxed);
  }

  /// Of all children that were visited: no weight is NaN or +infinity, and one is positive.
  bool passed() const { return valid_ && positive_; }

 private:
  void weigh_continuous(ConstBatchView x, std::span<double> w, Scratch& s) const {
    for (std::size_t n = 0; n < w.size(); ++n) w[n] += s.term[n];
    if (!filter_.functional_->uses_end()) return;
    s.end_sensor.reshape(s.sensor.components(), w.size());
    model_.fields->sensor(x, s.end_sensor);
    filter_.functional_->at_end(window_, s.sensor, s.derivative, s.end_sensor, w);
  }

  void weigh_discrete(ConstBatchView x, std::span<double> w, Scratch& s) const {
    if (window_.at_start || window_.observation.empty()) return;
    s.term.resize(w.size());
    model_.density->log_density(window_.observation, x, s.term);
    for (std::size_t n = 0; n < w.size(); ++n) w[n] += s.term[n];
    s.best_term = std::max(s.best_term, *std::ranges::max_element(s.term));
  }

  KlvFilter& filter_;
  const Model& model_;
  const ObservationWindow& window_;
  LogWeights& weight_;
  std::atomic<bool> valid_ = true, positive_ = false;
};

KlvFilter::KlvFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      functional_(make_functional(options)),
      thinning_(options.thinning.method == ThinningMethod::none ? nullptr : make_thinning(options.thinning)),
      grower_(model_, options_.flow, options_.tolerance, options_.formula, options_.threads),
      survivors_(first_generation(model_, options_.nodes)),
      current_(&survivors_),
      scratch_(options_.threads) {
  if (carries_likelihood()) survivors_.log_likelihood.assign(survivors_.size(), 0.0);
  warn_of_model(model_, warnings_);
}

std::string_view KlvFilter::name() const { return thinning_ ? "klv" : "full-tree"; }

// For good, or until their effective sample size asks that they decide.
bool KlvFilter::carries_likelihood() const {
  return options_.prune_weights == PruneWeights::cubature || (thinning_ && options_.ess_threshold < 1);
}

// The part of the weight that observations go to.
KlvFilter::LogWeights& KlvFilter::likelihood_of(Generation& g) const {
  return carries_likelihood() ? g.log_likelihood : g.log_weight;
}

void KlvFilter::advance(const ObservationWindow& window) {
  set_clock(model_, survivors_.states, window.start);
  weigh_start(window);
  if (window.length() > 0) {
    grow(window);
    thin(window);
  }
  ++statistics_.steps;
  time_ = window.end;
  stale_ = true;
}

// An observation at the window's start.
void KlvFilter::weigh_start(const ObservationWindow& window) {
  if (window.length() > 0 && !window.at_start) return;
  LogWeights& weight = likelihood_of(survivors_);
  if (model_.observation == ObservationKind::discrete && !window.observation.empty()) {
    start_term_.resize(survivors_.size());
    model_.density->log_density(window.observation, survivors_.states, start_term_);
    for (std::size_t n = 0; n < survivors_.size(); ++n) weight[n] += start_term_[n];
    warn_of_reach(model_, window.observation, *std::ranges::max_element(start_term_), window.start,
                  warnings_);
    current_ = &survivors_;
  }
  if (!(window.length() > 0)) check_log_weights(weight, window);
}

void KlvFilter::grow(const ObservationWindow& window) {
  Weigher weigher(*this, window);
  for (Scratch& s : scratch_) s.best_term = -std::numeric_limits<double>::infinity();
  grower_.grow(survivors_, window.length(), children_, failures_, &weigher);
  children_.time = window.end;
  set_clock(model_, children_.states, window.end);
  current_ = &children_;
  statistics_.children += children_.size();
  statistics_.flow = flow_before_;
  statistics_.flow += grower_.statistics();
  const bool intact = failures_.empty();
  if (!intact) handle_failures(window);
  if (!intact || !weigher.passed()) check_log_weights(likelihood_of(children_), window);
  if (model_.observation == ObservationKind::discrete && !window.at_start && !window.observation.empty()) {
    double best = -std::numeric_limits<double>::infinity();
    for (const Scratch& s : scratch_) best = std::max(best, s.best_term);
    warn_of_reach(model_, window.observation, best, window.end, warnings_);
  }
  const auto heaviest = std::ranges::max_element(survivors_.log_weight) - survivors_.log_weight.begin();
  warn_of_step(model_, std::as_const(survivors_.states).view().nodes(static_cast<std::size_t>(heaviest), 1),
               window.length(), window.start, warnings_);
}

void KlvFilter::handle_failures(const ObservationWindow& window) {
  // Where every node fails, none is left to stand for those that are dropped.
  if (options_.on_node_failure == OnNodeFailure::stop || failures_.size() == children_.size())
    throw_node_failure(failures_, model_, place(window));
  for (const NodeFailure& f : failures_)
    children_.log_weight[f.node] = -std::numeric_limits<double>::infinity();
  statistics_.dropped_nodes += failures_.size();
  failures_.clear();
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
  LogWeights &q = children_.log_weight, &L = children_.log_likelihood;
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
  const bool fresh = stale_;
  if (stale_) normalised_.assign(current_->log_weight, current_->log_likelihood, statistics_.steps, time_);
  stale_ = false;
  posterior_.time = time_;
  posterior_.log_evidence = normalised_.log_mass;
  posterior_.points = current_->states;
  posterior_.weight = normalised_.weight;
  posterior_.parents = current_ == &children_ ? children_.size() / options_.formula.paths.size() : 0;
  posterior_.bounds = model_.bounds;
  posterior_.kept = survivors_.size();
  if (fresh && model_.observation != ObservationKind::none)
    warn_of_law(model_, posterior_, normalised_.effective_size, warnings_);
  return posterior_;
}

}  // namespace wienertree
