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

// The part of log (exact over linearised likelihood) that each axis of a conditioned component has to do with: its
// coefficients of degree two and three in the Hermite polynomials, He_2(z_k), He_3(z_k), z_k z_l and z_k^2 z_l, whose
// squared norms are 2, 6, 1 and 2.
std::size_t terms(std::size_t d) { return 2 * d + d * (d - 1) / 2 + d * (d - 1); }

template <class F>
void for_terms(Eigen::Index d, F f) {  // f(index of the term, k, l)
  std::size_t term = 0;
  for (Eigen::Index k = 0; k < d; ++k) {
    f(term++, k, k);
    f(term++, k, k);
  }
  for (Eigen::Index k = 0; k < d; ++k)
    for (Eigen::Index l = 0; l < d; ++l)
      if (k != l) {
        if (k < l) f(term++, k, l);
        f(term++, k, l);
      }
}

template <int D>
void add_effects(const GaussianCubature& rule, Eigen::Index q, double ratio, std::vector<double>& out) {
  const auto d = rule.points.rows();
  const double w = rule.weights(q) * ratio;
  const auto z = rule.points.col(q);
  std::size_t term = 0;
  for (Eigen::Index k = 0; k < d; ++k) {
    out[term++] += w * (z(k) * z(k) - 1) / std::sqrt(2.0);
    out[term++] += w * z(k) * (z(k) * z(k) - 3) / std::sqrt(6.0);
  }
  for (Eigen::Index k = 0; k < d; ++k)
    for (Eigen::Index l = 0; l < d; ++l)
      if (k != l) {
        if (k < l) out[term++] += w * z(k) * z(l);
        out[term++] += w * (z(k) * z(k) - 1) * z(l) / std::sqrt(2.0);
      }
}

Eigen::Index worst_axis(const std::vector<double>& effects, Eigen::Index d) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(d);
  for_terms(d, [&](std::size_t term, Eigen::Index k, Eigen::Index l) {
    sum(k) += effects[term] * effects[term];
    if (l != k) sum(l) += effects[term] * effects[term];
  });
  Eigen::Index worst = 0;
  sum.maxCoeff(&worst);
  return worst;
}

}  // namespace

bool all_missing(std::span<const double> y) {
  return std::all_of(y.begin(), y.end(), [](double v) { return std::isnan(v); });
}

ComponentConditioning::ComponentConditioning(const Model& model)
    : model_(model), expansion_(model), rule_(rule_for(model.reported_dimension())) {}

ComponentConditioning::Result ComponentConditioning::condition(std::span<const double> y, double clock,
                                                               GaussianComponents& c, ThreadPool* threads) {
  if (y.empty() || all_missing(y)) return {};
  const std::size_t blocks = (c.size() + block - 1) / block,
                    workers = threads != nullptr ? threads->size() : 1;
  while (scratch_.size() < workers) scratch_.push_back(std::make_unique<Scratch>());
  reading_.departure.assign(c.size(), 0.0);
  reading_.hides.assign(c.size(), 0);
  reading_.guess.assign(c.size(), -INFINITY);
  reading_.narrowing.assign(c.size(), 1.0);
  reading_.axis.reshape(c.states(), c.size());
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
    sum += w * reading_.departure[n] * reading_.departure[n];
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

void ComponentConditioning::look_around(std::span<const double> y, double clock, std::size_t first,
                                        std::size_t count, const GaussianComponents& c, Scratch& s) {
  constexpr double seen = 8, unlike = 2, against_noise = 0.3, against_slope = 0.5, scales = 2;
  const std::size_t d = c.states(), points = static_cast<std::size_t>(rule_.weights.size());
  const bool sensor = expansion_.additive(), gaussian = !expansion_.gaussian_variances().empty();
  s.points.reshape(model_.state_dimension(), points * count);
  s.log_density.resize(points * count);
  const auto rows = static_cast<Eigen::Index>(d);
  for (std::size_t n = 0; n < count; ++n)
    for (std::size_t q = 0; q < points; ++q)
      for (std::size_t i = 0; i < d; ++i) {
        double x = c.mean(i, first + n);
        for (std::size_t k = 0; k <= i; ++k)
          x +=
              s.root(i * d + k, n) * rule_.points(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(q));
        s.points(i, q * count + n) = x;
      }
  expansion_.log_density(y, clock, s.points, s.log_density);
  if (sensor) {
    s.sensor.reshape(y.size(), points * count);
    model_.fields->sensor(s.points, s.sensor);
  }
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    for (std::size_t n = 0; n < count; ++n) {
      const SmallVector<D> mode = vector_of<D>(s.mode, d, n), gradient = vector_of<D>(s.best_gradient, d, n);
      const SmallSquare<D> A = square_of<D>(s.best_curvature, d, n);
      const double top = s.best[n], value = top + 0.5 * mode.squaredNorm();
      SmallVector<D> direction = SmallVector<D>::Zero(rows);
      double largest = -INFINITY, sum = 0, surplus = 0;
      for (std::size_t q = 0; q < points; ++q) largest = std::max(largest, s.log_density[q * count + n]);
      for (std::size_t q = 0; q < points; ++q) {
        const auto column = static_cast<Eigen::Index>(q);
        const double l = s.log_density[q * count + n];
        const SmallVector<D> z = rule_.points.col(column), off = z - mode;
        if (largest > -INFINITY) sum += rule_.weights(column) * std::exp(l - largest);
        const double height = l - 0.5 * z.squaredNorm();
        if (!(height > top - seen) || off.isZero(0)) continue;
        const double difference = std::abs(l - (value + gradient.dot(off) - 0.5 * off.dot(A * off)));
        // What is high counts most.
        if (difference > unlike && height - top + seen > surplus) {
          surplus = height - top + seen;
          direction = off;
        }
      }
      double guess = largest + std::log(sum), worst = 0;
      if (sensor) {
        double by_moments = 0;
        for (std::size_t i = 0; i < y.size(); ++i) {
          if (std::isnan(y[i])) continue;
          double mean = 0, variance = 0;
          SmallVector<D> slope = SmallVector<D>::Zero(rows);
          SmallSquare<D> bend = SmallSquare<D>::Zero(rows, rows);
          for (std::size_t q = 0; q < points; ++q)
            mean += rule_.weights(static_cast<Eigen::Index>(q)) * s.sensor(i, q * count + n);
          for (std::size_t q = 0; q < points; ++q) {
            const auto column = static_cast<Eigen::Index>(q);
            const double h = s.sensor(i, q * count + n) - mean, w = rule_.weights(column) * h;
            const SmallVector<D> z = rule_.points.col(column);
            variance += w * h;
            slope += w * z;
            bend += w * z * z.transpose();
          }
          const double scale = expansion_.scales()[i], affine = slope.norm();
          const double bent = std::sqrt(std::max(0.0, variance - affine * affine));
          const double S = scale * scale + variance, e = y[i] - mean;
          by_moments -= (e * e / S + std::log(2 * std::numbers::pi * S)) / 2;
          if (bent > against_noise * scale && bent > against_slope * affine && bent / scale > worst) {
            worst = bent / scale;
            const SymmetricEigen<D> eigen(bend);
            Eigen::Index at = 0;
            eigen.values.cwiseAbs().maxCoeff(&at);
            direction = eigen.vectors.col(at);
          }
          if (!gaussian && affine > scales * scale && affine / scale > worst) {
            worst = affine / scale;
            direction = slope;
          }
        }
        guess = std::max(guess, by_moments);
      }
      reading_.guess[first + n] = c.log_weight[first + n] + guess;
      if (direction.isZero(0) || !direction.allFinite()) continue;
      reading_.hides[first + n] = 1;
      const SmallSquare<D> L = square_of<D>(s.root, d, n);
      put_vector(SmallVector<D>(L * (direction / direction.norm())), s.step, n);
    }
  });
}

void ComponentConditioning::condition_block(std::span<const double> y, double clock, std::size_t first,
                                            std::size_t count, GaussianComponents& c, Scratch& s) {
  find_modes(y, clock, first, count, c, s);
  look_around(y, clock, first, count, c, s);
  const std::size_t d = c.states(), points = static_cast<std::size_t>(rule_.weights.size());
  s.points.reshape(model_.state_dimension(), points * count);
  s.log_density.resize(points * count);
  for_dimension(d, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    const auto rows = static_cast<Eigen::Index>(d);
    for (std::size_t n = 0; n < count; ++n) {
      const SmallSquare<D> L = square_of<D>(s.root, d, n);
      const SmallSquare<D> B = SmallSquare<D>::Identity(rows, rows) + square_of<D>(s.best_curvature, d, n);
      const SymmetricEigen<D> eigen(B);
      const SmallSquare<D> inverse_root =
          eigen.vectors * eigen.values.cwiseMax(1.0).cwiseSqrt().cwiseInverse().asDiagonal();
      const SmallVector<D> mode = vector_of<D>(s.mode, d, n);
      const SmallVector<D> top =
          mode + inverse_root * (inverse_root.transpose() * (vector_of<D>(s.best_gradient, d, n) - mode));
      const SmallVector<D> centre = vector_of<D>(c.mean, d, first + n) + L * top;
      const SmallSquare<D> spread = L * inverse_root;
      put_square(spread, s.curvature, n);
      put_vector(top, s.mode, n);
      // Kept beside the points: log |R|, and z_q = z^ + R^{-T} zeta_q from the inverse of R^T.
      s.best[n] = 0;
      for (Eigen::Index i = 0; i < rows; ++i) s.best[n] += std::log(std::max(eigen.values(i), 1.0)) / 2;
      put_square(inverse_root, s.best_curvature, n);
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
      s.ratio.assign(terms(d), 0.0);
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
        put_vector(vector_of<D>(s.step, d, n), reading_.axis, first + n);
        continue;
      }
      SmallVector<D> mean = SmallVector<D>::Zero(rows);
      SmallSquare<D> second = SmallSquare<D>::Zero(rows, rows);
      double mass = 0;
      for (std::size_t q = 0; q < points; ++q) {
        const auto column = static_cast<Eigen::Index>(q);
        const double ratio = s.log_density[q * count + n];
        if (finite) add_effects<D>(rule_, column, ratio - mean_ratio, s.ratio);
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
      reading_.departure[first + n] = finite ? std::sqrt(square_ratio) : 30;
      const Eigen::Index worst = worst_axis(s.ratio, rows);
      put_vector(SmallVector<D>(square_of<D>(s.curvature, d, n).col(worst) / inverse.col(worst).norm()),
                 reading_.axis, first + n);
      reading_.narrowing[first + n] = inverse.col(worst).squaredNorm();
      if (reading_.hides[first + n] != 0) {
        put_vector(vector_of<D>(s.step, d, n), reading_.axis, first + n);
        reading_.narrowing[first + n] = 1;
      }
      c.log_weight[first + n] += largest + std::log(mass);
      const SmallSquare<D> L = square_of<D>(s.root, d, n);
      const SmallVector<D> x = vector_of<D>(c.mean, d, first + n) + L * top + spread * mean;
      put_vector(x, c.mean, first + n);
      put_square(SmallSquare<D>(spread * second * spread.transpose()), c.covariance, first + n);
    }
  });
}

}  // namespace wienertree
