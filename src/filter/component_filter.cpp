#include "wienertree/filter/component_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/places.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

constexpr double negligible = 1e-14;  // of the largest weight

// A tilt towards a likelihood that is no Gaussian leads to twice the posterior's covariance or more: wider than each mode
// and than the shoulders of a heavy tail, at the price of twice the area in two dimensions. What it does to modes of
// little weight far away is not seen by runs that all have it: it is weakened as tolerances fall, and left out where they
// are above the default, which the coarsest run of the control of accuracy has.
constexpr double default_tolerance = 0.1;
double posterior_widening(double tolerance) { return 2 * default_tolerance / tolerance; }

// Departure of a component from Gaussian over a substep, in units of FilterOptions::substep_tolerance. Merging, once
// a substep, costs little in two dimensions and much in four, where patches are wide.
double substep_factor(std::size_t d) { return d == 2 ? 0.1 : d == 3 ? 0.3 : 1.0; }

// Width of a component in the tilted law, in standard deviations.
double default_kappa(std::size_t d) { return d <= 3 ? 0.15 : d == 4 ? 0.28 : 0.35; }

bool missing(std::span<const double> y) {
  return std::all_of(y.begin(), y.end(), [](double v) { return std::isnan(v); });
}

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
  clock_ = window.start;
  if (window.at_start) weigh(window, y, clock_);
  if (window.length() > 0) cross(window, window.at_start ? std::span<const double>() : y);
  clock_ = window.end;
  if (!window.at_start) weigh(window, y, clock_);
  check_bounds(window.end);
  time_ = window.end;
  ++statistics_.steps;
}

// ---- crossing a gap

void ComponentFilter::cross(const ObservationWindow& window, std::span<const double> y) {
  ComponentMerge::drop_negligible(components_, negligible);
  if (components_.size() > options_.nodes) merge_.merge(components_, options_.nodes);
  if (affine_) return transit(window.length());
  if (carry(window)) return;
  cross_in_substeps(window, y);
}

void ComponentFilter::transit(double length) {
  if (length != transition_length_) {
    transition_ = linear_transition(*affine_, length);
    transition_length_ = length;
  }
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
  const double largest = largest_log_weight(c.log_weight).value;
  double mass = 0, sum = 0;
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double w = std::exp(c.log_weight[n] - largest);
    mass += w;
    sum += w * out[n] * out[n];
  }
  return std::sqrt(sum / mass);
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
  if (!y.empty() && !missing(y)) tilts = plan(window, y, law, K, steps);
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

// Components that merging left too wide for the quotient are split to half the width that has none.
void ComponentFilter::divide_by(const Tilt& tilt) {
  divide(components_, tilt, wide_, &threads_);
  if (wide_.empty()) return;
  GaussianComponents rest, parts;
  std::vector<std::uint8_t> is_wide(components_.size(), 0);
  for (const std::uint32_t n : wide_) is_wide[n] = 1;
  const auto copy = [&](const GaussianComponents& from, std::size_t n, GaussianComponents& to,
                        std::size_t k) {
    to.log_weight[k] = from.log_weight[n];
    for (std::size_t i = 0; i < d_; ++i) to.mean(i, k) = from.mean(i, n);
    for (std::size_t i = 0; i < d_ * d_; ++i) to.covariance(i, k) = from.covariance(i, n);
  };
  rest.reshape(d_, wide_.size());
  for (std::size_t k = 0; k < wide_.size(); ++k) copy(components_, wide_[k], rest, k);
  // H^{-1}, with unit variance where H has none: there nothing is too wide.
  const SymmetricEigen<Eigen::Dynamic> eigen{SmallSquare<Eigen::Dynamic>(tilt.H)};
  const double largest = eigen.values.maxCoeff();
  Eigen::MatrixXd inverse = eigen.vectors *
                            (1 / eigen.values.array().max(1e-9 * largest)).matrix().asDiagonal() *
                            eigen.vectors.transpose();
  constexpr std::size_t all_it_takes = 1 << 18;
  split_.split(rest, inverse, 0.7, 0, all_it_takes, parts, &threads_);
  std::vector<std::uint32_t> still_wide;
  divide(parts, tilt, still_wide, &threads_);
  if (!still_wide.empty())
    throw RunError("a component is too wide for the tilt it carries", fmt::format("t = {:g}", time_));
  scratch_.reshape(d_, components_.size() - wide_.size() + parts.size());
  std::size_t to = 0;
  for (std::size_t n = 0; n < components_.size(); ++n)
    if (is_wide[n] == 0) copy(components_, n, scratch_, to++);
  for (std::size_t n = 0; n < parts.size(); ++n) copy(parts, n, scratch_, to++);
  components_.swap(scratch_);
}

// ---- the tilt

Tilt ComponentFilter::expanded_tilt(std::span<const double> y, double clock, const LawMoments& law) {
  Batch x(d_, 1), L(d_ * d_, 1), step(d_, 1), gradient(d_, 1), curvature(d_ * d_, 1);
  ObservationExpansion::Scratch scratch;
  std::vector<double> value(1);
  put_vector(law.mean, x, 0);
  for (std::size_t i = 0; i < d_; ++i) {
    const double sd =
        std::sqrt(std::max(0.0, law.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i))));
    for (std::size_t k = 0; k < d_; ++k) L(i * d_ + k, 0) = i == k ? 1.0 : 0.0;
    step(i, 0) = (update_->expansion().additive() ? 1e-3 : 0.1) * sd;
  }
  update_->expansion().expand(y, clock, x, L, step, value, gradient, curvature, scratch);
  return {law.mean, square_of<Eigen::Dynamic>(curvature, d_, 0), vector_of<Eigen::Dynamic>(gradient, d_, 0)};
}

std::vector<Tilt> ComponentFilter::plan(const ObservationWindow& window, std::span<const double> y,
                                        const MixtureMoments& law, std::size_t K, unsigned steps) {
  const LawMoments start{law.mean, law.covariance};
  const double end = clock_ + window.length();
  if (update_->expansion().linear_gaussian())
    return path_.plan(start, clock_, window.length(), K, steps,
                      [&](const LawMoments& reference) { return expanded_tilt(y, end, reference); });
  const double tolerance = options_.substep_tolerance;
  if (tolerance > 1.001 * default_tolerance) return std::vector<Tilt>(K + 1, Tilt::none(d_));
  const GaussianComponents before = components_;
  const std::size_t nodes = std::max<std::size_t>(60, options_.nodes / 4);
  substeps(std::vector<Tilt>(K + 1, Tilt::none(d_)), window.length(), steps, nodes);
  const MixtureMoments predicted = moments(components_);
  take_in(y, end, nodes);
  const MixtureMoments posterior = moments(components_);
  pilot_evidence_ = posterior.log_mass;
  components_ = before;
  const Tilt last = tilt_between({predicted.mean, predicted.covariance},
                                 {posterior.mean, posterior_widening(tolerance) * posterior.covariance});
  return path_.plan(start, clock_, window.length(), K, steps, [&](const LawMoments&) { return last; });
}

// ---- the observation

void ComponentFilter::weigh(const ObservationWindow& window, std::span<const double> y, double clock) {
  if (y.empty() || missing(y)) return;
  check_reach(window, y, clock);
  const double spread = take_in(y, clock, options_.nodes);
  if (spread > 0.15)
    warn(WarningKind::unfit_tilt, window.end,
         fmt::format("more components than {} were needed for the likelihood, whose logarithm departs from a "
                     "quadratic "
                     "by {:.2g} in those there are",
                     8 * options_.nodes, spread));
  const LargestLogWeight largest = largest_log_weight(components_.log_weight);
  if (!largest.all_valid || !(largest.value > -std::numeric_limits<double>::infinity()))
    throw RunError("the observation has no likelihood", place_and_observation(window));
  const MixtureMoments law = moments(components_);
  if (pilot_evidence_ && std::abs(*pilot_evidence_ - law.log_mass) > 0.5)
    warn(WarningKind::unfit_tilt, window.end,
         fmt::format("the likelihood is far from Gaussian: filters with and without a tilt towards it differ "
                     "by {:.2g} "
                     "in log evidence",
                     std::abs(*pilot_evidence_ - law.log_mass)));
  if (nonlinear_ && components_.size() > 1 && law.effective_size < 5)
    warn(WarningKind::few_atoms, window.end,
         fmt::format("{:.1f} of {} components carry the law after an observation", law.effective_size,
                     components_.size()));
}

// Divides what the likelihood calls for, and conditions.
double ComponentFilter::take_in(std::span<const double> y, double clock, std::size_t nodes) {
  const ComponentUpdate::Limits limits{0.25 * options_.substep_tolerance, (d_ == 2 ? 24 : 8) * nodes};
  const double left = update_->condition(y, clock, limits, components_, &threads_);
  if (components_.size() > 8 * nodes) merge_.merge(components_, 8 * nodes);
  return left;
}

// (y - predicted)^2/S of each component of y with Gaussian noise.
void ComponentFilter::check_reach(const ObservationWindow& window, std::span<const double> y, double clock) {
  const std::vector<double>& R = update_->expansion().gaussian_variances();
  if (R.empty()) return;
  const MixtureMoments law = moments(components_);
  const GaussianCubature& rule = equations_.rule();
  const auto points = static_cast<std::size_t>(rule.weights.size());
  const Eigen::MatrixXd L = semidefinite_root(law.covariance);
  Batch x(model_.state_dimension(), points), h(y.size(), points);
  for (std::size_t q = 0; q < points; ++q)
    put_vector(Eigen::VectorXd(law.mean + L * rule.points.col(static_cast<Eigen::Index>(q))), x, q);
  equations_.complete(x, clock);
  model_.fields->sensor(x, h);
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (std::isnan(y[i])) continue;
    double mean = 0, variance = R[i];
    for (std::size_t q = 0; q < points; ++q) mean += rule.weights(static_cast<Eigen::Index>(q)) * h(i, q);
    for (std::size_t q = 0; q < points; ++q)
      variance += rule.weights(static_cast<Eigen::Index>(q)) * (h(i, q) - mean) * (h(i, q) - mean);
    const double distance = (y[i] - mean) * (y[i] - mean) / variance;
    if (distance > 50)
      warn(WarningKind::out_of_reach, window.end,
           fmt::format("y{} = {:g} lies {:.1f} standard deviations from its prediction {:.4g}", i + 1, y[i],
                       std::sqrt(distance), mean));
  }
}

void ComponentFilter::check_bounds(double time) {
  for (std::size_t i = 0; i < d_; ++i) {
    const StateBound& b = model_.bounds[i];
    if (!b.bounded()) continue;
    const double largest = largest_log_weight(components_.log_weight).value;
    double mass = 0, outside = 0;
    for (std::size_t n = 0; n < components_.size(); ++n) {
      const double w = std::exp(components_.log_weight[n] - largest), x = components_.mean(i, n);
      const double sd = std::sqrt(std::max(0.0, components_.covariance(i * d_ + i, n)));
      const auto beyond = [&](double distance) {
        return sd > 0 ? 0.5 * std::erfc(distance / (sd * std::sqrt(2.0))) : distance < 0 ? 1.0 : 0.0;
      };
      mass += w;
      outside += w * (beyond(x - b.lower) + beyond(b.upper - x));
    }
    if (outside > 1e-3 * mass)
      warn(WarningKind::at_bound, time,
           fmt::format("{:.2g} of the law of {} lies beyond its bounds, where fields are taken at the bound",
                       outside / mass, model_.state_names[i]));
  }
}

void ComponentFilter::warn(WarningKind kind, double time, std::string text) {
  for (const FilterWarning& w : warnings_)
    if (w.kind == kind) return;
  warnings_.push_back({kind, time, std::move(text)});
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
