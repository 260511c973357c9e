#include "wienertree/filter/euler_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/filter/places.hpp"
#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 1024;  // particles whose arrays stay in cache; even, as normals come in pairs

template <class Body>
void for_blocks(ThreadPool& pool, std::size_t N, Body body) {
  pool.for_each((N + block - 1) / block, [&](std::size_t task, std::size_t) {
    const std::size_t first = task * block;
    body(first, std::min(block, N - first));
  });
}

}  // namespace

EulerFilter::EulerFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      functional_(make_functional(options.functional)),
      thinning_(options.thinning.method == ThinningMethod::none ? nullptr : make_thinning(options.thinning)),
      pool_(options.threads),
      kept_(options.nodes) {
  const std::size_t N = options_.nodes, d = model_.state_dimension();
  const RandomStream random{options_.seed, options_.launch, 0, Purpose::initial_state};
  draw_initial(model_, random, N, x_);
  next_.reshape(d, N);
  noise_.reshape(model_.noise_dimension(), N);
  log_weight_.assign(N, -std::log(static_cast<double>(N)));
  term_.resize(N);
  normalised_.assign(log_weight_, {}, "start");
}

void EulerFilter::advance(const ObservationWindow& window) {
  resample_if_due(window);
  weigh_at_start(window);
  if (window.length() > 0) {
    move(window);
    weigh_at_end(window);
  }
  ++statistics_.steps;
  statistics_.children += options_.nodes;
  time_ = window.end;
  normalised_.assign(log_weight_, {}, place(window));
}

// Before the step, so that the posterior reported for the last one was that of the weighted particles.
void EulerFilter::resample_if_due(const ObservationWindow& window) {
  kept_ = options_.nodes;
  if (!thinning_ || !weighed_ ||
      normalised_.effective_size > options_.ess_threshold * static_cast<double>(options_.nodes))
    return;
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::thinning};
  thinning_->thin({x_, log_weight_, 0}, options_.nodes, random, selection_);
  for (std::size_t i = 0; i < x_.components(); ++i) {
    const double* from = x_.component(i).data();
    double* to = next_.component(i).data();
    for (std::size_t s = 0; s < selection_.site.size(); ++s)
      to = std::fill_n(to, selection_.count[s], from[selection_.site[s]]);
  }
  x_.swap(next_);
  std::fill(log_weight_.begin(), log_weight_.end(),
            normalised_.log_mass - std::log(static_cast<double>(options_.nodes)));
  kept_ = selection_.site.size();
  weighed_ = false;
}

void EulerFilter::weigh_at_start(const ObservationWindow& window) {
  const bool here = window.at_start || window.length() == 0;
  if (model_.observation == ObservationKind::discrete && here && !window.observation.empty()) {
    model_.density->log_density(window.observation, x_, term_);
    for (std::size_t n = 0; n < term_.size(); ++n) log_weight_[n] += term_[n];
    weighed_ = true;
  }
  if (model_.observation != ObservationKind::continuous) return;
  const std::size_t k = model_.fields->sensor_dimension(), p = model_.noise_dimension();
  sensor_.reshape(k, x_.nodes());
  derivative_.reshape(functional_->uses_derivative() ? k * p : 0, x_.nodes());
  for_blocks(pool_, x_.nodes(), [&](std::size_t first, std::size_t count) {
    const auto x = x_.view().nodes(first, count);
    const auto h = sensor_.view().nodes(first, count);
    BatchView G;
    model_.fields->sensor(x, h);
    if (functional_->uses_derivative())
      model_.fields->sensor_derivative(x, G = derivative_.view().nodes(first, count));
    const std::span<double> term = {term_.data() + first, count};
    functional_->at_start(window, h, G, term);
    for (std::size_t n = 0; n < count; ++n) log_weight_[first + n] += term[n];
  });
  weighed_ = true;
}

void EulerFilter::move(const ObservationWindow& window) {
  const double s = window.length(), root = std::sqrt(s);
  const std::size_t p = noise_.components(), N = x_.nodes();
  const RandomStream random{options_.seed, options_.launch, static_cast<std::uint32_t>(window.step),
                            Purpose::euler_noise};
  for_blocks(pool_, N, [&](std::size_t first, std::size_t count) {
    const auto dB = noise_.view().nodes(first, count);
    // Component r of particle n is draw r * 2 ceil(N/2) + n: blocks start at even draws, whatever N.
    for (std::size_t r = 0; r < p; ++r) {
      const std::span<double> z = dB.component(r);
      random.normals(r * (N + N % 2) + first, z);
      for (double& v : z) v *= root;
    }
    model_.fields->euler_step(x_.view().nodes(first, count), s, dB, next_.view().nodes(first, count));
  });
  x_.swap(next_);
  keep_inside_bounds(window);
}

void EulerFilter::keep_inside_bounds(const ObservationWindow& window) {
  for (std::size_t i = 0; i < model_.state_dimension(); ++i) {
    const StateBound& b = model_.bounds[i];
    const std::span<double> x = x_.component(i);
    if (b.bounded() && b.boundary != Boundary::error) {
      for (double& v : x) v = v < b.lower ? b.lower : v > b.upper ? b.upper : v;  // NaN stays
    }
    for (std::size_t n = 0; n < x.size(); ++n)
      if (!(std::isfinite(x[n]) && x[n] >= b.lower && x[n] <= b.upper))
        throw RunError(
            std::isfinite(x[n]) ? "a particle left the state's bounds" : "a particle's state is not finite",
            fmt::format("{}, particle {}, state {}", place(window), n, model_.state_names[i]),
            fmt::format("{}", x[n]));
  }
}

void EulerFilter::weigh_at_end(const ObservationWindow& window) {
  if (model_.observation == ObservationKind::discrete) {
    if (window.at_start || window.observation.empty()) return;
    model_.density->log_density(window.observation, x_, term_);
    for (std::size_t n = 0; n < term_.size(); ++n) log_weight_[n] += term_[n];
    weighed_ = true;
  } else if (model_.observation == ObservationKind::continuous && functional_->uses_end()) {
    end_sensor_.reshape(sensor_.components(), x_.nodes());
    for_blocks(pool_, x_.nodes(), [&](std::size_t first, std::size_t count) {
      const auto h1 = end_sensor_.view().nodes(first, count);
      model_.fields->sensor(x_.view().nodes(first, count), h1);
      functional_->at_end(window, sensor_.view().nodes(first, count), h1,
                          {log_weight_.data() + first, count});
    });
  }
}

const Posterior& EulerFilter::posterior() {
  posterior_.time = time_;
  posterior_.log_evidence = normalised_.log_mass;
  posterior_.points = x_;
  posterior_.weight = normalised_.weight;
  posterior_.kept = kept_;
  return posterior_;
}

}  // namespace wienertree
