#include "wienertree/filter/gaussian_mixture_filter.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/bounds.hpp"
#include "wienertree/filter/clock.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 1024;  // Gaussians whose arrays stay in cache; even, as normals come in pairs

}  // namespace

double mixture_alpha(const FilterOptions& options) {
  return options.alpha.value_or(1 / std::sqrt(static_cast<double>(options.nodes)));
}

GaussianMixtureFilter::GaussianMixtureFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      alpha_(mixture_alpha(options)),
      functional_(make_functional(options)),
      thinning_(make_thinning(options.thinning)),
      rule_(rule_of_one_gaussian(static_cast<int>(model.state_dimension()))),
      pool_(options.threads),
      scratch_(pool_.size()),
      spread_(alpha_ * options.beta > 0),
      kept_(options.nodes) {
  const std::size_t N = options_.nodes, d = model_.state_dimension();
  const RandomStream random{options_.seed, options_.launch, 0, Purpose::initial_state};
  draw_initial(model_, random, N, v_);
  next_.reshape(d, N);
  covariance_.reshape(d * d, N);
  next_covariance_.reshape(d * d, N);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j < d; ++j)
      std::fill_n(covariance_.component(i * d + j).begin(), N, i == j ? alpha_ * options_.beta : 0.0);
  log_weight_.assign(N, -std::log(static_cast<double>(N)));
}

template <class Body>
void GaussianMixtureFilter::for_each_block(Body body) {
  pool_.for_each((v_.nodes() + block - 1) / block, [&](std::size_t task, std::size_t thread) {
    const std::size_t first = task * block;
    body(first, std::min(block, v_.nodes() - first), scratch_[thread]);
  });
}

void GaussianMixtureFilter::advance(const ObservationWindow& window) {
  if (statistics_.steps > 0) correct(window);
  set_clock(model_, v_, window.start);
  for_each_block(
      [&](std::size_t first, std::size_t count, Scratch& scratch) { step(window, first, count, scratch); });
  weighed_ = weighed_ || model_.observation == ObservationKind::continuous || !window.observation.empty();
  if (window.length() > 0) {
    v_.swap(next_);
    set_clock(model_, v_, window.end);
    spread_ = spread_ || alpha_ > 0;
  }
  check_log_weights(log_weight_, window);
  stale_ = true;
  ++statistics_.steps;
  statistics_.children += options_.nodes;
  time_ = window.end;
}

// Before the step, so that the posterior reported for the last one was that of the weighted Gaussians.
// Without an observation since the last correction the weights are equal, and every Gaussian has one
// offspring.
void GaussianMixtureFilter::correct(const ObservationWindow& window) {
  kept_ = options_.nodes;
  if (weighed_) {
    const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                              Purpose::thinning};
    thinning_->thin({v_, log_weight_, 0}, options_.nodes, random, selection_);
    replicate(v_, next_);
    v_.swap(next_);
    if (spread_) replicate(covariance_, next_covariance_);
    if (spread_) covariance_.swap(next_covariance_);
    // A site of o Gaussians weighs o times one.
    std::fill(log_weight_.begin(), log_weight_.end(),
              selection_.log_weight[0] - std::log(static_cast<double>(selection_.count[0])));
    kept_ = selection_.site.size();
    weighed_ = false;
  }
  if (!spread_) return;
  for_each_block([&](std::size_t first, std::size_t count, Scratch& scratch) {
    draw_offspring(window, first, count, scratch);
  });
  spread_ = alpha_ * options_.beta > 0;
}

void GaussianMixtureFilter::replicate(const Batch& from, Batch& to) const {
  for (std::size_t i = 0; i < from.components(); ++i) {
    const double* source = from.component(i).data();
    double* target = to.component(i).data();
    for (std::size_t s = 0; s < selection_.site.size(); ++s)
      target = std::fill_n(target, selection_.count[s], source[selection_.site[s]]);
  }
}

void GaussianMixtureFilter::draw_offspring(const ObservationWindow& window, std::size_t first,
                                           std::size_t count, Scratch& scratch) {
  const std::size_t d = v_.components(), N = v_.nodes();
  const auto v = v_.view().nodes(first, count), covariance = covariance_.view().nodes(first, count);
  scratch.root.reshape(d * d, count);
  cholesky(covariance, d, scratch.root);
  scratch.noise.reshape(d, count);
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::mixture_offspring};
  // Component i of Gaussian n is draw i * 2 ceil(N/2) + n: blocks start at even draws, whatever N.
  for (std::size_t i = 0; i < d; ++i) random.normals(i * (N + N % 2) + first, scratch.noise.component(i));
  for (std::size_t i = 0; i < d; ++i) {
    double* x = v.component(i).data();
    for (std::size_t k = 0; k <= i; ++k) {
      const double* L = scratch.root.component(i * d + k).data();
      const double* z = scratch.noise.component(k).data();
      for (std::size_t n = 0; n < count; ++n) x[n] += L[n] * z[n];
    }
    for (std::size_t j = 0; j < d; ++j)
      std::fill_n(covariance.component(i * d + j).data(), count, i == j ? alpha_ * options_.beta : 0.0);
  }
  keep_inside_bounds(model_, window, first, v);
}

// One block through the whole step, so that it passes through memory once.
void GaussianMixtureFilter::step(const ObservationWindow& window, std::size_t first, std::size_t count,
                                 Scratch& scratch) {
  const auto v = v_.view().nodes(first, count), next = next_.view().nodes(first, count),
             covariance = covariance_.view().nodes(first, count);
  const std::span<double> log_weight = {log_weight_.data() + first, count};
  const bool discrete = model_.observation == ObservationKind::discrete && !window.observation.empty(),
             continuous = model_.observation == ObservationKind::continuous,
             at_start = window.at_start || window.length() == 0;
  const std::size_t k = model_.fields->sensor_dimension(), p = model_.noise_dimension();
  if (discrete && at_start) observe(window, spread_, v, covariance, log_weight, scratch);
  if (continuous) {
    scratch.term.resize(count);
    scratch.sensor.reshape(k, count);
    scratch.derivative.reshape(functional_->uses_derivative() ? k * p : 0, count);
    model_.fields->sensor(v, scratch.sensor);
    if (functional_->uses_derivative()) model_.fields->sensor_derivative(v, scratch.derivative);
    functional_->at_start(window, scratch.sensor, scratch.derivative, scratch.term);
    for (std::size_t n = 0; n < count; ++n) log_weight[n] += scratch.term[n];
  }
  if (!(window.length() > 0)) return;
  move(window, first, v, next, covariance, scratch);
  if (model_.inputs && discrete) set_clock(model_, next, window.end);
  if (discrete && !at_start) observe(window, spread_ || alpha_ > 0, next, covariance, log_weight, scratch);
  if (continuous && functional_->uses_end()) {
    scratch.end_sensor.reshape(k, count);
    model_.fields->sensor(next, scratch.end_sensor);
    functional_->at_end(window, scratch.sensor, scratch.derivative, scratch.end_sensor, log_weight);
  }
}

void GaussianMixtureFilter::move(const ObservationWindow& window, std::size_t first, ConstBatchView v,
                                 BatchView next, BatchView covariance, Scratch& scratch) const {
  const double s = window.length(), root = std::sqrt((1 - alpha_) * s);
  const std::size_t N = v_.nodes(), d = v.components(), p = model_.noise_dimension(), count = v.nodes();
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::mixture_noise};
  scratch.noise.reshape(p, count);
  for (std::size_t r = 0; r < p; ++r) {
    const std::span<double> z = scratch.noise.component(r);
    random.normals(r * (N + N % 2) + first, z);
    for (double& value : z) value *= root;
  }
  model_.fields->euler_step(v, s, scratch.noise, next);
  keep_inside_bounds(model_, window, first, next);
  if (!(alpha_ > 0)) return;
  scratch.diffusion.reshape(d * p, count);
  model_.fields->diffusion(v, scratch.diffusion);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j < d; ++j) {
      double* c = covariance.component(i * d + j).data();
      for (std::size_t r = 0; r < p; ++r) {
        const double* a = scratch.diffusion.component(i * p + r).data();
        const double* b = scratch.diffusion.component(j * p + r).data();
        for (std::size_t n = 0; n < count; ++n) c[n] += alpha_ * s * (a[n] * b[n]);
      }
    }
}

void GaussianMixtureFilter::observe(const ObservationWindow& window, bool spread, BatchView v,
                                    BatchView covariance, std::span<double> log_weight,
                                    Scratch& scratch) const {
  if (spread)
    return scratch.conditioning.condition(*model_.density, rule_, window.observation, v, covariance,
                                          log_weight);
  scratch.term.resize(v.nodes());
  model_.density->log_density(window.observation, v, scratch.term);
  for (std::size_t n = 0; n < v.nodes(); ++n) log_weight[n] += scratch.term[n];
}

void GaussianMixtureFilter::normalise() {
  if (stale_) normalised_.assign(log_weight_, {}, statistics_.steps, time_);
  stale_ = false;
}

void GaussianMixtureFilter::exchange_state(StateArchive& archive) {
  archive(v_, covariance_, spread_, log_weight_, time_, weighed_, kept_);
  StateArchive::require(v_.components() == next_.components() && v_.nodes() == next_.nodes() &&
                        covariance_.components() == next_covariance_.components() &&
                        covariance_.nodes() == v_.nodes() && log_weight_.size() == v_.nodes());
  stale_ = true;
}

const Posterior& GaussianMixtureFilter::posterior() {
  normalise();
  posterior_.time = time_;
  posterior_.log_evidence = normalised_.log_mass;
  posterior_.points = v_;
  posterior_.weight = normalised_.weight;
  posterior_.covariance = spread_ ? ConstBatchView(covariance_) : ConstBatchView();
  posterior_.kept = kept_;
  return posterior_;
}

}  // namespace wienertree
