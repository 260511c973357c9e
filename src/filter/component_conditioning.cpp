#include "wienertree/filter/component_conditioning.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 64;
constexpr int most_iterations = 24;

GaussianCubature rule_for(std::size_t d) {
  return d <= 2 ? gauss_hermite(static_cast<int>(d), 5) : gaussian_cubature_5(static_cast<int>(d));
}

bool all_missing(std::span<const double> y) {
  return std::all_of(y.begin(), y.end(), [](double v) { return std::isnan(v); });
}

}  // namespace

ComponentConditioning::ComponentConditioning(const Model& model)
    : model_(model), expansion_(model), rule_(rule_for(model.reported_dimension())) {}

ComponentConditioning::Result ComponentConditioning::condition(std::span<const double> y, double clock,
                                                               GaussianComponents& c, ThreadPool* threads) {
  if (y.empty() || all_missing(y)) return {};
  const std::size_t blocks = (c.size() + block - 1) / block,
                    workers = threads != nullptr ? threads->size() : 1;
  while (scratch_.size() < workers) scratch_.push_back(std::make_unique<Scratch>());
  variance_.assign(c.size(), 0.0);
  const auto one = [&](std::size_t task, std::size_t thread) {
    const std::size_t first = task * block, count = std::min(block, c.size() - first);
    if (expansion_.linear_gaussian())
      condition_linear(y, first, count, c);
    else
      condition_block(y, clock, first, count, c, *scratch_[thread]);
  };
  if (threads != nullptr && blocks > 1)
    threads->for_each(blocks, one);
  else
    for (std::size_t b = 0; b < blocks; ++b) one(b, 0);
  if (expansion_.linear_gaussian()) return {};
  const double largest = largest_log_weight(c.log_weight).value;
  double mass = 0, sum = 0;
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double w = std::exp(c.log_weight[n] - largest);
    if (!(w > 0)) continue;
    mass += w;
    sum += w * variance_[n];
  }
  return {mass > 0 ? std::sqrt(sum / mass) : 0.0};
}

void ComponentConditioning::condition_linear(std::span<const double> y, std::size_t first, std::size_t count,
                                             GaussianComponents& c) {
  const AffineSensor& sensor = *expansion_.affine_sensor();
  const std::size_t d = c.states();
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    for (std::size_t n = first; n < first + count; ++n) {
      SmallVector<D> m = vector_of<D>(c.mean, d, n);
      SmallSquare<D> P = square_of<D>(c.covariance, d, n);
      for (std::size_t i = 0; i < y.size(); ++i) {
        if (std::isnan(y[i])) continue;
        const auto row = static_cast<Eigen::Index>(i);
        const SmallVector<D> h = sensor.linear.row(row).transpose();
        const double R = expansion_.gaussian_variances()[i];
        const SmallVector<D> Ph = P * h;
        const double s = h.dot(Ph) + R, e = y[i] - h.dot(m) - sensor.constant(row);
        c.log_weight[n] -= (std::log(2 * std::numbers::pi * s) + e * e / s) / 2;
        const SmallVector<D> K = Ph / s;
        SmallSquare<D> rest = SmallSquare<D>::Identity(m.size(), m.size());
        rest.noalias() -= K * h.transpose();
        m += e * K;
        P = (rest * P * rest.transpose() + R * K * K.transpose()).eval();
        P = (0.5 * (P + P.transpose())).eval();
      }
      put_vector(m, c.mean, n);
      put_square(P, c.covariance, n);
    }
  });
}

// Modes of l(m + L z) - z^T z/2 by Newton's method with halved steps. Differences are taken over a hundredth of a
// standard deviation of the law that the last iteration found, so that a likelihood much narrower than the
// component is seen at its own scale.
void ComponentConditioning::find_modes(std::span<const double> y, double clock, std::size_t first,
                                       std::size_t count, const GaussianComponents& c, Scratch& s) const {
  const std::size_t d = c.states();
  const double part = expansion_.additive() ? 1e-3 : 3e-2;
  const ConstBatchView mean = c.mean.view().nodes(first, count);
  s.root.reshape(d * d, count);
  cholesky(c.covariance.view().nodes(first, count), d, s.root);
  for (Batch* b : {&s.mode, &s.trial, &s.step, &s.x, &s.gradient, &s.best_gradient}) b->reshape(d, count);
  for (Batch* b : {&s.curvature, &s.best_curvature}) b->reshape(d * d, count);
  s.value.resize(count);
  s.best.assign(count, -INFINITY);
  s.fraction.assign(count, 1.0);  // < 0: done
  for (std::size_t i = 0; i < d; ++i) {
    std::fill_n(s.trial.component(i).data(), count, 0.0);
    std::fill_n(s.mode.component(i).data(), count, 0.0);
    std::fill_n(s.step.component(i).data(), count, part);
    std::fill_n(s.best_gradient.component(i).data(), count, 0.0);
  }
  for (std::size_t i = 0; i < d * d; ++i) std::fill_n(s.best_curvature.component(i).data(), count, 0.0);
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
      for (std::size_t n = 0; n < count; ++n)
        for (std::size_t i = 0; i < d; ++i) {
          double at = mean(i, n);
          for (std::size_t k = 0; k <= i; ++k) at += s.root(i * d + k, n) * s.trial(k, n);
          s.x(i, n) = at;
        }
      expansion_.expand(y, clock, s.x, s.root, s.step, s.value, s.gradient, s.curvature, s.expansion);
      std::size_t open = 0;
      for (std::size_t n = 0; n < count; ++n) {
        if (s.fraction[n] < 0) continue;
        const SmallVector<D> z = vector_of<D>(s.trial, d, n);
        const double objective = s.value[n] - 0.5 * z.squaredNorm();
        const bool first_time = iteration == 0;
        if (first_time || objective >= s.best[n] - 1e-10 * (1 + std::abs(s.best[n]))) {
          const SmallVector<D> before = vector_of<D>(s.mode, d, n);
          put_vector(z, s.mode, n);
          for (std::size_t i = 0; i < d; ++i) s.best_gradient(i, n) = s.gradient(i, n);
          for (std::size_t i = 0; i < d * d; ++i) s.best_curvature(i, n) = s.curvature(i, n);
          s.best[n] = objective;
          s.fraction[n] = 1;
          (void)before;
        } else {
          s.fraction[n] /= 2;
          if (s.fraction[n] < 1e-3) {
            s.fraction[n] = -1;
            continue;
          }
        }
        const SmallSquare<D> B = SmallSquare<D>::Identity(rows, rows) + square_of<D>(s.best_curvature, d, n);
        const Eigen::LLT<SmallSquare<D>> root(B);
        const SmallVector<D> mode = vector_of<D>(s.mode, d, n);
        const SmallVector<D> direction = root.solve(vector_of<D>(s.best_gradient, d, n) - mode);
        const SmallSquare<D> inverse = root.solve(SmallSquare<D>::Identity(rows, rows));
        // Newton's decrement: the step in standard deviations of the law about the mode.
        if (!(direction.dot(B * direction) > 1e-8)) {
          s.fraction[n] = -1;
          continue;
        }
        for (Eigen::Index i = 0; i < rows; ++i)
          s.step(static_cast<std::size_t>(i), n) = part * std::sqrt(std::max(inverse(i, i), 1e-30));
        put_vector(SmallVector<D>(mode + s.fraction[n] * direction), s.trial, n);
        ++open;
      }
      if (open == 0) break;
    }
  });
}

void ComponentConditioning::condition_block(std::span<const double> y, double clock, std::size_t first,
                                            std::size_t count, GaussianComponents& c, Scratch& s) {
  find_modes(y, clock, first, count, c, s);
  const std::size_t d = c.states(), points = static_cast<std::size_t>(rule_.weights.size());
  s.points.reshape(model_.state_dimension(), points * count);
  s.log_density.resize(points * count);
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    for (std::size_t n = 0; n < count; ++n) {
      const SmallSquare<D> L = square_of<D>(s.root, d, n);
      const SmallSquare<D> B = SmallSquare<D>::Identity(rows, rows) + square_of<D>(s.best_curvature, d, n);
      const Eigen::LLT<SmallSquare<D>> root(B);
      const SmallVector<D> mode = vector_of<D>(s.mode, d, n);
      const SmallVector<D> top = mode + root.solve(vector_of<D>(s.best_gradient, d, n) - mode);
      const SmallVector<D> centre = vector_of<D>(c.mean, d, first + n) + L * top;
      const SmallSquare<D> spread =
          L * SmallSquare<D>(root.matrixU().solve(SmallSquare<D>::Identity(rows, rows)));
      put_square(spread, s.curvature, n);
      put_vector(top, s.mode, n);
      // Kept beside the points: log |R|, and z_q = z^ + R^{-T} zeta_q from the inverse of R^T.
      s.best[n] = 0;
      for (Eigen::Index i = 0; i < rows; ++i) s.best[n] += std::log(root.matrixLLT()(i, i));
      put_square(SmallSquare<D>(root.matrixU().solve(SmallSquare<D>::Identity(rows, rows))), s.best_curvature,
                 n);
      for (std::size_t q = 0; q < points; ++q) {
        const SmallVector<D> x = centre + spread * rule_.points.col(static_cast<Eigen::Index>(q));
        put_vector(x, s.points, q * count + n);
      }
    }
    expansion_.log_density(y, clock, s.points, s.log_density);
    for (std::size_t n = 0; n < count; ++n) {
      const SmallVector<D> top = vector_of<D>(s.mode, d, n);
      const SmallSquare<D> inverse = square_of<D>(s.best_curvature, d, n),
                           spread = square_of<D>(s.curvature, d, n);
      double largest = -INFINITY, mean_ratio = 0, square_ratio = 0;
      bool finite = true;
      for (std::size_t q = 0; q < points; ++q) {
        const auto column = static_cast<Eigen::Index>(q);
        const SmallVector<D> z = top + inverse * rule_.points.col(column);
        double& ratio = s.log_density[q * count + n];
        ratio += 0.5 * (rule_.points.col(column).squaredNorm() - z.squaredNorm()) - s.best[n];
        finite = finite && std::isfinite(ratio);
        largest = std::max(largest, ratio);
        if (std::isnan(ratio)) largest = ratio;
        mean_ratio += rule_.weights(column) * ratio;
      }
      if (!(largest > -INFINITY) || std::isnan(largest)) {
        c.log_weight[first + n] += largest;
        continue;
      }
      SmallVector<D> mean = SmallVector<D>::Zero(rows);
      SmallSquare<D> second = SmallSquare<D>::Zero(rows, rows);
      double mass = 0;
      for (std::size_t q = 0; q < points; ++q) {
        const auto column = static_cast<Eigen::Index>(q);
        const double ratio = s.log_density[q * count + n];
        square_ratio += finite ? rule_.weights(column) * (ratio - mean_ratio) * (ratio - mean_ratio) : 0.0;
        const double w = rule_.weights(column) * std::exp(ratio - largest);
        mass += w;
        mean += w * rule_.points.col(column);
      }
      mean /= mass;
      for (std::size_t q = 0; q < points; ++q) {
        const auto column = static_cast<Eigen::Index>(q);
        const double w = rule_.weights(column) * std::exp(s.log_density[q * count + n] - largest) / mass;
        const SmallVector<D> e = rule_.points.col(column) - mean;
        second.noalias() += w * e * e.transpose();
      }
      variance_[first + n] = finite ? square_ratio : 1e3;
      c.log_weight[first + n] += largest + std::log(mass);
      const SmallSquare<D> L = square_of<D>(s.root, d, n);
      const SmallVector<D> x = vector_of<D>(c.mean, d, first + n) + L * top + spread * mean;
      put_vector(x, c.mean, first + n);
      put_square(SmallSquare<D>(spread * second * spread.transpose()), c.covariance, first + n);
    }
  });
}

}  // namespace wienertree
