#include "wienertree/filter/component_filter.hpp"

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/places.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

constexpr double negligible = 1e-14;  // of the largest weight

// Departure of a component from Gaussian over a substep, in units of FilterOptions::substep_tolerance. Merging, once
// a substep, costs little in two dimensions and much in four, where patches are wide.
double substep_factor(std::size_t d) { return d == 2 ? 0.1 : d == 3 ? 0.3 : 1.0; }

// Width of a component in the tilted law, in standard deviations.
double default_kappa(std::size_t d) { return d <= 3 ? 0.15 : d == 4 ? 0.28 : 0.35; }

// dX = (A X + a) dt + B dW, clock and all; nothing where the signal is none, or bounded.
std::optional<LinearGaussianModel> affine_signal(const Model& model) {
  const AffineFields* fields = model.fields->affine_fields();
  if (fields == nullptr) return {};
  for (const StateBound& b : model.bounds)
    if (b.bounded()) return {};
  const auto D = static_cast<Eigen::Index>(model.state_dimension());
  LinearGaussianModel out;
  out.A = fields->linear[0];
  out.a = fields->constant[0];
  out.Q = Eigen::MatrixXd::Zero(D, D);
  for (std::size_t k = 1; k < fields->linear.size(); ++k) {
    if (!fields->linear[k].isZero(0)) return {};
    out.Q += fields->constant[k] * fields->constant[k].transpose();
  }
  return out;
}

}  // namespace

std::size_t default_components(std::size_t dimension) {
  return dimension <= 3 ? 400 : dimension == 4 ? 4000 : 3000;
}

ComponentFilter::ComponentFilter(const Model& model, const FilterOptions& options)
    : model_(model),
      options_(options),
      d_(model.reported_dimension()),
      kappa_(default_kappa(d_)),
      threads_(options.threads),
      equations_(model_, gaussian_cubature_5(static_cast<int>(d_))),
      affine_(affine_signal(model_)),
      path_(model_, equations_),
      moving_(options.threads) {
  if (model_.density) update_.emplace(model_);
  start();
  shared_noise_ = one_noise_for_all();
}

bool ComponentFilter::one_noise_for_all() const {
  if (model_.noise_dimension() != 1) return false;
  const std::size_t D = model_.state_dimension();
  Batch x(D, 1), sigma(D, 1);
  for (std::size_t i = 0; i < D; ++i) x(i, 0) = model_.initial[i];
  model_.fields->diffusion(x, sigma);
  for (std::size_t i = 0; i < d_; ++i)
    if (sigma(i, 0) == 0) return false;
  return true;
}

void ComponentFilter::start() {
  components_.reshape(d_, 1);
  components_.log_weight[0] = 0;
  for (std::size_t i = 0; i < d_; ++i) {
    const auto I = static_cast<Eigen::Index>(i);
    components_.mean(i, 0) = model_.initial_law ? model_.initial_law->mean(I) : model_.initial[i];
    for (std::size_t j = 0; j < d_; ++j)
      components_.covariance(i * d_ + j, 0) =
          model_.initial_law ? model_.initial_law->covariance(I, static_cast<Eigen::Index>(j)) : 0.0;
  }
  if (model_.has_clock) clock_ = model_.initial[d_];
}

void ComponentFilter::advance(const ObservationWindow& window) {
  const std::span<const double> y = window.observation;
  nonlinear_ = false;
  pilot_evidence_.reset();
  clock_ = model_.clock(window.start);
  if (window.at_start) weigh(window, y, clock_);
  if (window.length() > 0) cross(window, window.at_start ? std::span<const double>() : y);
  clock_ = model_.clock(window.end);
  if (!window.at_start) weigh(window, y, clock_);
  check_bounds(window.end);
  time_ = window.end;
  ++statistics_.steps;
}

// ---- crossing a gap

void ComponentFilter::cross(const ObservationWindow& window, std::span<const double> y) {
  ComponentMerge::drop_negligible(components_, negligible);
  if (components_.size() > options_.nodes) merge_.merge(components_, options_.nodes);
  if (affine_) {
    forget_what_noise_hides(window.length());
    return transit(window.length());
  }
  if (carry(window)) return;
  cross_in_substeps(window, y);
}

void ComponentFilter::prepare_transition(double length) {
  if (length == transition_length_) return;
  transition_ = linear_transition(*affine_, length);
  transition_length_ = length;
}

// Components that the noise of a gap, in all directions, leaves indistinguishable are one from now on.
void ComponentFilter::forget_what_noise_hides(double length) {
  if (components_.size() < 2) return;
  prepare_transition(length);
  const auto d = static_cast<Eigen::Index>(d_);
  const SmallSquare<Eigen::Dynamic> Q = transition_.Q.topLeftCorner(d, d);
  const Eigen::LLT<Eigen::MatrixXd> root(Q);
  if (root.info() != Eigen::Success || root.matrixLLT().diagonal().minCoeff() <= 1e-6 * std::sqrt(Q.trace()))
    return;
  merge_.merge_close(components_, root.matrixL().solve(Eigen::MatrixXd(transition_.F.topLeftCorner(d, d))),
                     0.4 * std::cbrt(options_.substep_tolerance));
}

void ComponentFilter::transit(double length) {
  prepare_transition(length);
  const auto d = static_cast<Eigen::Index>(d_);
  Eigen::VectorXd offset = transition_.f.head(d);
  if (model_.has_clock) offset += clock_ * transition_.F.topRightCorner(d, 1);
  for_dimension(d_, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const SmallSquare<D> F = transition_.F.topLeftCorner(d, d), Q = transition_.Q.topLeftCorner(d, d);
    for (std::size_t n = 0; n < components_.size(); ++n) {
      const SmallVector<D> m = F * vector_of<D>(components_.mean, d_, n) + offset;
      const SmallSquare<D> P = F * square_of<D>(components_.covariance, d_, n) * F.transpose() + Q;
      put_vector(m, components_.mean, n);
      put_square(SmallSquare<D>(0.5 * (P + P.transpose())), components_.covariance, n);
    }
  });
  statistics_.children += components_.size();
  statistics_.flow.node_segments += components_.size();
}

// The Runge-Kutta method of order 4 needs |J| h below 1/2 (Lawson 1966); few components are moved with h a fifth of
// that, since a single one can be exact.
unsigned ComponentFilter::steps_for(double length) const {
  const double most = components_.size() <= 16 ? 0.1 : 0.5;
  return static_cast<unsigned>(std::clamp(std::ceil(rate_ * length / most), 1.0, 10000.0));
}

// Of up to 64 components that count, the root mean square over their weights.
double ComponentFilter::departure(const GaussianComponents& c, double clock, double length) {
  std::vector<double> out(c.size());
  equations_.departure_from_affine(c.mean, c.covariance, clock, length, out, moving_[0]);
  return root_mean_square(c, out);
}

bool ComponentFilter::carry(const ObservationWindow& window) {
  const double length = window.length(), tolerance = 0.1 * options_.substep_tolerance;
  const std::size_t N = components_.size();
  weight_.resize(N);
  equations_.rate(components_.mean, clock_, weight_, moving_[0]);
  const double least = largest_log_weight(components_.log_weight).value + std::log(1e-6);
  rate_ = 0;
  for (std::size_t n = 0; n < N; ++n)
    if (components_.log_weight[n] > least) rate_ = std::max(rate_, weight_[n]);
  if (!std::isfinite(rate_)) throw RunError("the drift has no finite derivative", place(window));
  // A sample of the components tells whether all can be carried.
  const std::size_t stride = (N + 63) / 64, count = (N + stride - 1) / stride;
  scratch_.reshape(d_, count);
  for (std::size_t k = 0; k < count; ++k) {
    scratch_.log_weight[k] = components_.log_weight[k * stride];
    for (std::size_t i = 0; i < d_; ++i) scratch_.mean(i, k) = components_.mean(i, k * stride);
    for (std::size_t i = 0; i < d_ * d_; ++i)
      scratch_.covariance(i, k) = components_.covariance(i, k * stride);
  }
  const unsigned steps = steps_for(length);
  for (int half = 0; half < 2; ++half) {
    for (std::size_t first = 0; first < count; first += equations_.block()) {
      const std::size_t n = std::min(equations_.block(), count - first);
      equations_.move(scratch_.mean.view().nodes(first, n), scratch_.covariance.view().nodes(first, n),
                      clock_ + half * length / 2, length / 2, std::max(1U, (steps + 1) / 2), moving_[0]);
    }
    if (!(departure(scratch_, clock_ + (half + 1) * length / 2, length) < tolerance)) return false;
  }
  move(clock_, length, steps);
  return true;
}

void ComponentFilter::move(double clock, double length, unsigned steps) {
  const std::size_t N = components_.size(), block = equations_.block();
  const std::size_t points = static_cast<std::size_t>(equations_.rule().weights.size());
  threads_.for_each((N + block - 1) / block, [&](std::size_t task, std::size_t thread) {
    const std::size_t first = task * block, count = std::min(block, N - first);
    equations_.move(components_.mean.view().nodes(first, count),
                    components_.covariance.view().nodes(first, count), clock, length, steps, moving_[thread]);
  });
  statistics_.children += N * points;
  statistics_.flow.node_segments += N * points;
  statistics_.flow.field_evaluations += 4 * steps * N * points;
}

// Enough that a component of the split law stays Gaussian over a substep.
std::size_t ComponentFilter::substeps_for(const MixtureMoments& law, double length) {
  const GaussianCubature& rule = equations_.rule();
  const auto points = static_cast<std::size_t>(rule.weights.size());
  const Eigen::MatrixXd L = semidefinite_root(law.covariance);
  GaussianComponents probe;
  for (std::size_t K = d_ <= 3 ? 2 : 1;; K += K < 4 ? 1 : K / 2) {
    const double s = length / static_cast<double>(K);
    probe.reshape(d_, points);
    for (std::size_t q = 0; q < points; ++q) {
      const auto column = static_cast<Eigen::Index>(q);
      probe.log_weight[q] = std::log(rule.weights(column));
      put_vector(Eigen::VectorXd(law.mean + L * rule.points.col(column)), probe.mean, q);
      put_square(Eigen::MatrixXd(kappa_ * kappa_ * law.covariance), probe.covariance, q);
    }
    equations_.move(probe.mean, probe.covariance, clock_, s, steps_for(s), moving_[0]);
    if (K >= 64 || departure(probe, clock_ + s, s) < substep_factor(d_) * options_.substep_tolerance)
      return K;
  }
}

void ComponentFilter::cross_in_substeps(const ObservationWindow& window, std::span<const double> y) {
  nonlinear_ = true;
  if (shared_noise_)
    warn(WarningKind::shared_noise, window.end,
         "one Brownian motion drives all states of a nonlinear signal, whose law lies on a thin sheet");
  const MixtureMoments law = moments(components_);
  const std::size_t K = substeps_for(law, window.length());
  const unsigned steps = steps_for(window.length() / static_cast<double>(K));
  std::vector<Tilt> tilts(K + 1, Tilt::none(d_));
  if (!y.empty() && !all_missing(y)) tilts = plan(window, y, law, K, steps);
  substeps(tilts, window.length(), steps, options_.nodes);
}

void ComponentFilter::substeps(const std::vector<Tilt>& tilts, double length, unsigned steps,
                               std::size_t nodes) {
  const std::size_t K = tilts.size() - 1;
  const double s = length / static_cast<double>(K);
  multiply(components_, tilts[0], &threads_);
  for (std::size_t j = 0; j < K; ++j) {
    narrow(nodes);
    divide_by(tilts[j]);
    move(clock_ + static_cast<double>(j) * s, s, steps);
    if (j + 1 < K) multiply(components_, tilts[j + 1], &threads_);
  }
}

// Splits what is wide in the present law and merges to `nodes`.
void ComponentFilter::narrow(std::size_t nodes) {
  ComponentMerge::drop_negligible(components_, negligible);
  const MixtureMoments law = moments(components_);
  if (!(law.covariance.diagonal().maxCoeff() > 0)) return;
  split_.split(components_, law.covariance, kappa_, 4 * nodes, (d_ == 2 ? 16 : 4) * nodes, scratch_,
               &threads_);
  components_.swap(scratch_);
  merge_.merge(components_, nodes);
}

// ---- state

void ComponentFilter::exchange_state(StateArchive& archive) {
  archive(components_, clock_, time_);
  StateArchive::require(components_.size() > 0 && components_.states() == d_ &&
                        components_.mean.nodes() == components_.size() &&
                        components_.covariance.components() == d_ * d_ &&
                        components_.covariance.nodes() == components_.size());
}

const Posterior& ComponentFilter::posterior() {
  const std::size_t N = components_.size(), D = model_.state_dimension();
  const MixtureMoments law = moments(components_);
  weight_.resize(N);
  for (std::size_t n = 0; n < N; ++n) weight_[n] = std::exp(components_.log_weight[n] - law.log_mass);
  posterior_.time = time_;
  posterior_.log_evidence = law.log_mass;
  posterior_.weight = weight_;
  posterior_.kept = N;
  posterior_.parents = 0;
  posterior_.points = components_.mean;
  posterior_.covariance = components_.covariance;
  if (model_.has_clock) {
    points_.reshape(D, N);
    covariance_.reshape(D * D, N);
    for (std::size_t i = 0; i < D; ++i)
      for (std::size_t n = 0; n < N; ++n) {
        points_(i, n) = i < d_ ? components_.mean(i, n) : clock_;
        for (std::size_t j = 0; j < D; ++j)
          covariance_(i * D + j, n) = i < d_ && j < d_ ? components_.covariance(i * d_ + j, n) : 0.0;
      }
    posterior_.points = points_;
    posterior_.covariance = covariance_;
  }
  const bool at_a_point = std::all_of(posterior_.covariance.data(),
                                      posterior_.covariance.data() + posterior_.covariance.components() * N,
                                      [](double v) { return v == 0; });
  if (at_a_point) posterior_.covariance = {};
  return posterior_;
}

}  // namespace wienertree
