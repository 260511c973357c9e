#include "wienertree/filter/euler_filter.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/bounds.hpp"
#include "wienertree/filter/clock.hpp"
#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 1024;  // particles whose arrays stay in cache; even, as normals come in pairs

}  // namespace

EulerFilter::EulerFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      functional_(make_functional(options)),
      thinning_(options.thinning.method == ThinningMethod::none ? nullptr : make_thinning(options.thinning)),
      pool_(options.threads),
      scratch_(pool_.size()),
      kept_(options.nodes) {
  const std::size_t N = options_.nodes;
  const RandomStream random{options_.seed, options_.launch, 0, Purpose::initial_state};
  draw_initial(model_, random, N, x_);
  next_.reshape(model_.state_dimension(), N);
  log_weight_.assign(N, -std::log(static_cast<double>(N)));
}

void EulerFilter::advance(const ObservationWindow& window) {
  resample_if_due(window);
  set_clock(model_, x_, window.start);
  pool_.for_each((x_.nodes() + block - 1) / block, [&](std::size_t task, std::size_t thread) {
    const std::size_t first = task * block;
    step(window, first, std::min(block, x_.nodes() - first), scratch_[thread]);
  });
  if (window.length() > 0) {
    x_.swap(next_);
    set_clock(model_, x_, window.end);
  }
  weighed_ = weighed_ || model_.observation == ObservationKind::continuous || !window.observation.empty();
  check_log_weights(log_weight_, window);
  stale_ = true;
  ++statistics_.steps;
  statistics_.children += options_.nodes;
  time_ = window.end;
}

// Before the step, so that the posterior reported for the last one was that of the weighted particles.
void EulerFilter::resample_if_due(const ObservationWindow& window) {
  kept_ = options_.nodes;
  if (!thinning_ || !weighed_) return;
  const auto N = static_cast<double>(options_.nodes);
  if (options_.ess_threshold < 1) {
    normalise();
    if (normalised_.effective_size > options_.ess_threshold * N) return;
  }
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::thinning};
  thinning_->thin({x_, log_weight_, 0, &pool_}, options_.nodes, random, selection_);
  const std::size_t kept = selection_.site.size();
  for (std::size_t i = 0; i < x_.components(); ++i) {
    const double* from = x_.component(i).data();
    double* to = next_.component(i).data();
    double* const end = to + next_.nodes();
    // Two copies at once: most particles have one child or two, which branching would have to guess.
    for (std::size_t s = 0; s < kept; ++s) {
      const double x = from[selection_.site[s]];
      const std::uint32_t children = selection_.count[s];
      to[0] = x;
      to[to + 1 < end ? 1 : 0] = x;
      if (children > 2) std::fill_n(to, children, x);
      to += children;
    }
  }
  x_.swap(next_);
  // A site of o particles weighs o times a particle.
  const double particle = selection_.log_weight[0] - std::log(static_cast<double>(selection_.count[0]));
  std::fill(log_weight_.begin(), log_weight_.end(), particle);
  kept_ = kept;
  weighed_ = false;
}

// One block through the whole step, so that it passes through memory once.
void EulerFilter::step(const ObservationWindow& window, std::size_t first, std::size_t count,
                       Scratch& scratch) {
  const auto x = x_.view().nodes(first, count), next = next_.view().nodes(first, count);
  const std::span<double> log_weight = {log_weight_.data() + first, count};
  const bool discrete = model_.observation == ObservationKind::discrete && !window.observation.empty(),
             continuous = model_.observation == ObservationKind::continuous,
             at_start = window.at_start || window.length() == 0;
  const std::size_t k = model_.fields->sensor_dimension(), p = model_.noise_dimension();
  scratch.term.resize(block);
  const std::span<double> term = {scratch.term.data(), count};
  const auto add_term = [&] {
    for (std::size_t n = 0; n < count; ++n) log_weight[n] += term[n];
  };
  const auto add_density = [&](ConstBatchView at) {
    model_.density->log_density(window.observation, at, term);
    add_term();
  };
  if (discrete && at_start) add_density(x);
  if (continuous) {
    scratch.sensor.reshape(k, count);
    scratch.derivative.reshape(functional_->uses_derivative() ? k * p : 0, count);
    model_.fields->sensor(x, scratch.sensor);
    if (functional_->uses_derivative()) model_.fields->sensor_derivative(x, scratch.derivative);
    functional_->at_start(window, scratch.sensor, scratch.derivative, term);
    add_term();
  }
  if (!(window.length() > 0)) return;
  move(window, first, x, next, scratch);
  if (model_.inputs && discrete) set_clock(model_, next, window.end);
  if (discrete && !at_start) add_density(next);
  if (continuous && functional_->uses_end()) {
    scratch.end_sensor.reshape(k, count);
    model_.fields->sensor(next, scratch.end_sensor);
    functional_->at_end(window, scratch.sensor, scratch.derivative, scratch.end_sensor, log_weight);
  }
}

void EulerFilter::move(const ObservationWindow& window, std::size_t first, ConstBatchView x, BatchView next,
                       Scratch& scratch) const {
  const double s = window.length(), root = std::sqrt(s);
  const std::size_t N = x_.nodes();
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::euler_noise};
  scratch.noise.reshape(model_.noise_dimension(), x.nodes());
  // Component r of particle n is draw r * 2 ceil(N/2) + n: blocks start at even draws, whatever N.
  for (std::size_t r = 0; r < scratch.noise.components(); ++r) {
    const std::span<double> z = scratch.noise.component(r);
    random.normals(r * (N + N % 2) + first, z);
    for (double& v : z) v *= root;
  }
  model_.fields->euler_step(x, s, scratch.noise, next);
  keep_inside_bounds(model_, window, first, next);
}

void EulerFilter::normalise() {
  if (stale_) normalised_.assign(log_weight_, {}, statistics_.steps, time_);
  stale_ = false;
}

void EulerFilter::exchange_state(StateArchive& archive) {
  archive(x_, log_weight_, time_, weighed_, kept_);
  StateArchive::require(x_.components() == next_.components() && x_.nodes() == next_.nodes() &&
                        log_weight_.size() == x_.nodes());
  stale_ = true;
}

const Posterior& EulerFilter::posterior() {
  normalise();
  posterior_.time = time_;
  posterior_.log_evidence = normalised_.log_mass;
  posterior_.points = x_;
  posterior_.weight = normalised_.weight;
  posterior_.kept = kept_;
  return posterior_;
}

}  // namespace wienertree
