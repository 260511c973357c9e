// The filter of components: tilts towards the next observation.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/filter/component_filter.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

// A tilt towards a likelihood that is no Gaussian leads to twice the posterior's covariance or more: wider than each mode
// and than the shoulders of a heavy tail, at the price of twice the area in two dimensions. What it does to modes of
// little weight far away is not seen by runs that all have it: it is weakened as tolerances fall, and left out where they
// are above the default, which the coarsest run of the control of accuracy has.
constexpr double default_tolerance = 0.1;
double posterior_widening(double tolerance) { return 2 * default_tolerance / tolerance; }

}  // namespace

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
  const double end = model_.inputs ? model_.clock(window.end) : clock_ + window.length();
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

}  // namespace wienertree
