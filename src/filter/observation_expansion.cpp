#include "wienertree/filter/observation_expansion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

}  // namespace

ObservationExpansion::ObservationExpansion(const Model& model)
    : model_(model), d_(model.reported_dimension()), k_(model.observation_dimension()) {
  variances_ = model.density->gaussian_variances();
  std::vector<double> zero(k_, 0.0);
  try {
    additive_ =
        std::isfinite(model.density->log_noise_density(zero)) && model.fields->sensor_dimension() == k_;
  } catch (const InputError&) {  // a density of its own
    additive_ = false;
  }
  if (!additive_) return;
  if (!model.has_clock) sensor_ = model.fields->affine_sensor();
  scale_.resize(k_);
  for (std::size_t i = 0; i < k_; ++i) {
    double low = 1e-300, high = 1e300;  // bisected in the logarithm
    for (int it = 0; it < 200 && high > 1.01 * low; ++it) {
      const double middle = std::sqrt(low) * std::sqrt(high);
      (std::abs(noise(i, middle) - noise(i, 0)) < 0.5 ? low : high) = middle;
    }
    scale_[i] = low;
  }
}

double ObservationExpansion::noise(std::size_t i, double v) const {
  thread_local std::vector<double> values;
  values.assign(k_, missing);
  values[i] = v;
  return model_.density->log_noise_density(values);
}

void ObservationExpansion::complete(BatchView points, double clock) const {
  for (std::size_t i = 0; i < d_; ++i) {
    const StateBound& b = model_.bounds[i];
    if (!b.bounded()) continue;
    for (double& v : points.component(i)) v = v < b.lower ? b.lower : v > b.upper ? b.upper : v;
  }
  if (model_.has_clock) std::fill_n(points.component(d_).data(), points.nodes(), clock);
}

void ObservationExpansion::log_density(std::span<const double> y, double clock, BatchView points,
                                       std::span<double> out) const {
  complete(points, clock);
  model_.density->log_density(y, points, out);
}

void ObservationExpansion::expand(std::span<const double> y, double clock, ConstBatchView x, ConstBatchView L,
                                  ConstBatchView step, std::span<double> value, BatchView gradient,
                                  BatchView curvature, Scratch& s) const {
  const std::size_t N = x.nodes(), layers = 1 + 2 * d_;
  s.points.reshape(model_.state_dimension(), layers * N);
  for (std::size_t layer = 0; layer < layers; ++layer)
    for (std::size_t i = 0; i < d_; ++i)
      for (std::size_t n = 0; n < N; ++n) {
        double at = x(i, n);
        if (layer > 0) {
          const std::size_t k = (layer - 1) / 2;
          at += (layer % 2 == 1 ? 1 : -1) * step(k, n) * L(i * d_ + k, n);
        }
        s.points(i, layer * N + n) = at;
      }
  if (!additive_) {
    expand_any(y, clock, x, L, step, gradient, curvature, s);
    std::copy_n(s.value.data(), N, value.data());
    return;
  }
  complete(s.points, clock);
  s.sensor.reshape(k_, layers * N);
  model_.fields->sensor(s.points, s.sensor);
  expand_additive(y, x, gradient, curvature, step, s);
  model_.density->log_density(y, s.points.view().nodes(0, N), value);
}

void ObservationExpansion::expand_additive(std::span<const double> y, ConstBatchView x, BatchView gradient,
                                           BatchView curvature, ConstBatchView step, Scratch& s) const {
  const std::size_t N = x.nodes();
  for (std::size_t c = 0; c < gradient.components(); ++c) std::fill_n(gradient.component(c).data(), N, 0.0);
  for (std::size_t c = 0; c < curvature.components(); ++c) std::fill_n(curvature.component(c).data(), N, 0.0);
  std::vector<double> J(d_);
  for (std::size_t i = 0; i < k_; ++i) {
    if (std::isnan(y[i])) continue;
    for (std::size_t n = 0; n < N; ++n) {
      const double r = y[i] - s.sensor(i, n);
      double slope, weight;
      if (!variances_.empty()) {
        slope = -r / variances_[i];
        weight = 1 / variances_[i];
      } else {
        const double e = 0.01 * scale_[i], up = noise(i, r + e), at = noise(i, r), down = noise(i, r - e);
        slope = (up - down) / (2 * e);
        weight = -(up - 2 * at + down) / (e * e);
        const double least = 1e-3 / (scale_[i] * scale_[i]);
        if (!(weight > least)) weight = std::abs(r) > e ? std::max(-slope / r, 0.0) : least;
      }
      for (std::size_t k = 0; k < d_; ++k)
        J[k] = step(k, n) > 0
                   ? (s.sensor(i, (1 + 2 * k) * N + n) - s.sensor(i, (2 + 2 * k) * N + n)) / (2 * step(k, n))
                   : 0.0;
      for (std::size_t k = 0; k < d_; ++k) {
        gradient(k, n) -= J[k] * slope;
        for (std::size_t l = 0; l < d_; ++l) curvature(k * d_ + l, n) += J[k] * weight * J[l];
      }
    }
  }
}

void ObservationExpansion::expand_any(std::span<const double> y, double clock, ConstBatchView x,
                                      ConstBatchView L, ConstBatchView step, BatchView gradient,
                                      BatchView curvature, Scratch& s) const {
  const std::size_t N = x.nodes(), axes = 1 + 2 * d_, pairs = d_ * (d_ - 1) / 2, layers = axes + 2 * pairs;
  Batch points(model_.state_dimension(), layers * N);
  for (std::size_t i = 0; i < d_; ++i) {
    std::copy_n(s.points.component(i).data(), axes * N, points.component(i).data());
    std::size_t layer = axes;
    for (std::size_t k = 0; k < d_; ++k)
      for (std::size_t l = 0; l < k; ++l)
        for (const double sign : {1.0, -1.0}) {
          for (std::size_t n = 0; n < N; ++n)
            points(i, layer * N + n) =
                x(i, n) + sign * (step(k, n) * L(i * d_ + k, n) + step(l, n) * L(i * d_ + l, n));
          ++layer;
        }
  }
  s.value.resize(layers * N);
  log_density(y, clock, points, s.value);
  for_dimension(d_, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto d = static_cast<Eigen::Index>(d_);
    for (std::size_t n = 0; n < N; ++n) {
      const auto at = [&](std::size_t layer) { return s.value[layer * N + n]; };
      const auto e = [&](std::size_t k) { return step(k, n); };
      SmallSquare<D> A(d, d);
      SmallVector<D> b(d);
      for (std::size_t k = 0; k < d_; ++k) {
        const auto K = static_cast<Eigen::Index>(k);
        const double up = at(1 + 2 * k), down = at(2 + 2 * k);
        b(K) = e(k) > 0 ? (up - down) / (2 * e(k)) : 0.0;
        A(K, K) = e(k) > 0 ? -(up - 2 * at(0) + down) / (e(k) * e(k)) : 0.0;
      }
      std::size_t layer = axes;
      for (std::size_t k = 0; k < d_; ++k)
        for (std::size_t l = 0; l < k; ++l, layer += 2) {
          const double both = at(layer) + at(layer + 1) - 2 * at(0);
          const auto K = static_cast<Eigen::Index>(k), M = static_cast<Eigen::Index>(l);
          const double mixed = e(k) > 0 && e(l) > 0 ? (both + A(K, K) * e(k) * e(k) + A(M, M) * e(l) * e(l)) /
                                                          (2 * e(k) * e(l))
                                                    : 0.0;
          A(K, M) = A(M, K) = -mixed;
        }
      if (A.allFinite() && b.allFinite()) {
        const SymmetricEigen<D> eigen(A);
        A = eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
      } else {
        A.setZero();
        b.setZero();
      }
      put_square(A, curvature, n);
      put_vector(b, gradient, n);
    }
  });
}

}  // namespace wienertree
