#include "wienertree/filter/moment_equations.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

double weight_of(const GaussianCubature& rule, std::size_t q) {
  return rule.weights(static_cast<Eigen::Index>(q));
}
double coordinate(const GaussianCubature& rule, std::size_t k, std::size_t q) {
  return rule.points(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(q));
}

void add_multiple(double factor, const double* x, double* out, std::size_t n) {
  if (factor == 0) return;
  for (std::size_t k = 0; k < n; ++k) out[k] += factor * x[k];
}

void add_product(double factor, const double* x, const double* y, double* out, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k) out[k] += factor * (x[k] * y[k]);
}

// out = x + factor y, all components.
void advance(ConstBatchView x, double factor, const Batch& y, Batch& out) {
  out.reshape(x.components(), x.nodes());
  for (std::size_t i = 0; i < x.components(); ++i) {
    const double *a = x.component(i).data(), *b = y.component(i).data();
    double* o = out.component(i).data();
    for (std::size_t k = 0; k < x.nodes(); ++k) o[k] = a[k] + factor * b[k];
  }
}

void clear(Batch& batch) {
  for (std::size_t i = 0; i < batch.components(); ++i)
    std::fill_n(batch.component(i).data(), batch.nodes(), 0.0);
}

}  // namespace

// About 2000 points at a time stay in cache with all their fields.
MomentEquations::MomentEquations(const Model& model, const GaussianCubature& rule)
    : model_(model),
      rule_(rule),
      d_(model.reported_dimension()),
      points_(static_cast<std::size_t>(rule.weights.size())),
      block_(std::max<std::size_t>(8, 2048 / points_ / 8 * 8)) {}

void MomentEquations::complete(BatchView points, double clock) const {
  for (std::size_t i = 0; i < d_; ++i) {
    const StateBound& b = model_.bounds[i];
    if (!b.bounded()) continue;
    for (double& v : points.component(i)) v = v < b.lower ? b.lower : v > b.upper ? b.upper : v;
  }
  if (model_.has_clock) std::fill_n(points.component(d_).data(), points.nodes(), clock);
}

// Point q of Gaussian n is node q N + n.
void MomentEquations::lay_points(ConstBatchView mean, ConstBatchView covariance, double clock,
                                 Scratch& s) const {
  const std::size_t N = mean.nodes();
  s.root.reshape(d_ * d_, N);
  cholesky(covariance, d_, s.root);
  s.points.reshape(model_.state_dimension(), N * points_);
  for (std::size_t q = 0; q < points_; ++q)
    for (std::size_t i = 0; i < d_; ++i) {
      double* x = s.points.component(i).data() + q * N;
      std::copy_n(mean.component(i).data(), N, x);
      for (std::size_t k = 0; k <= i; ++k)
        add_multiple(coordinate(rule_, k, q), s.root.component(i * d_ + k).data(), x, N);
    }
  complete(s.points, clock);
}

void MomentEquations::rates(ConstBatchView mean, ConstBatchView covariance, double clock, Batch& mean_rate,
                            Batch& covariance_rate, Scratch& s) const {
  const std::size_t N = mean.nodes();
  lay_points(mean, covariance, clock, s);
  s.drift.reshape(model_.state_dimension(), N * points_);
  model_.fields->ito_drift(s.points, s.drift);
  mean_rate.reshape(d_, N);
  covariance_rate.reshape(d_ * d_, N);
  s.slope.reshape(d_ * d_, N);  // E b z^T
  clear(mean_rate);
  clear(covariance_rate);
  clear(s.slope);
  for (std::size_t q = 0; q < points_; ++q)
    for (std::size_t i = 0; i < d_; ++i) {
      const double* b = s.drift.component(i).data() + q * N;
      add_multiple(weight_of(rule_, q), b, mean_rate.component(i).data(), N);
      for (std::size_t k = 0; k < d_; ++k)
        add_multiple(weight_of(rule_, q) * coordinate(rule_, k, q), b, s.slope.component(i * d_ + k).data(),
                     N);
    }
  add_diffusion(N, covariance_rate, s);
  // E b (x - m)^T = (E b z^T) L^T, added with its transpose to the lower triangle, which is then copied.
  for (std::size_t i = 0; i < d_; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double* rate = covariance_rate.component(i * d_ + j).data();
      for (std::size_t k = 0; k <= j; ++k)
        add_product(1, s.slope.component(i * d_ + k).data(), s.root.component(j * d_ + k).data(), rate, N);
      for (std::size_t k = 0; k <= i; ++k)
        add_product(1, s.slope.component(j * d_ + k).data(), s.root.component(i * d_ + k).data(), rate, N);
      if (i != j) std::copy_n(rate, N, covariance_rate.component(j * d_ + i).data());
    }
}

// The lower triangle of E a. Where sigma is the same at all points of the block, one of them will do.
void MomentEquations::add_diffusion(std::size_t N, Batch& covariance_rate, Scratch& s) const {
  const std::size_t p = model_.noise_dimension(), D = model_.state_dimension();
  s.diffusion.reshape(D * p, N * points_);
  model_.fields->diffusion(s.points, s.diffusion);
  bool constant = true;
  for (std::size_t c = 0; c < d_ * p && constant; ++c) {
    const auto values = s.diffusion.component(c);
    const double first = values[0];
    std::size_t differing = 0;
    for (const double v : values) differing += v == first ? 0 : 1;
    constant = differing == 0;
  }
  for (std::size_t i = 0; i < d_; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      for (std::size_t r = 0; r < p; ++r) {
        const double *x = s.diffusion.component(i * p + r).data(),
                     *y = s.diffusion.component(j * p + r).data();
        double* rate = covariance_rate.component(i * d_ + j).data();
        if (constant) {
          const double product = x[0] * y[0];
          for (std::size_t n = 0; n < N; ++n) rate[n] += product;
        } else {
          for (std::size_t q = 0; q < points_; ++q)
            add_product(weight_of(rule_, q), x + q * N, y + q * N, rate, N);
        }
      }
}

void MomentEquations::move(BatchView mean, BatchView covariance, double clock, double length, unsigned steps,
                           Scratch& s) const {
  const double h = length / steps;
  for (unsigned step = 0; step < steps; ++step) {
    const double t = clock + step * h;
    rates(mean, covariance, t, s.mean_rate[0], s.covariance_rate[0], s);
    for (std::size_t stage = 1; stage < 4; ++stage) {
      const double part = stage == 3 ? h : h / 2;
      advance(mean, part, s.mean_rate[stage - 1], s.mean);
      advance(covariance, part, s.covariance_rate[stage - 1], s.covariance);
      rates(s.mean, s.covariance, t + part, s.mean_rate[stage], s.covariance_rate[stage], s);
    }
    const auto finish = [&](BatchView x, const Batch(&rate)[4]) {
      for (std::size_t i = 0; i < x.components(); ++i)
        for (std::size_t n = 0; n < x.nodes(); ++n)
          x(i, n) += h / 6 * (rate[0](i, n) + 2 * rate[1](i, n) + 2 * rate[2](i, n) + rate[3](i, n));
    };
    finish(mean, s.mean_rate);
    finish(covariance, s.covariance_rate);
  }
}

void MomentEquations::departure_from_affine(ConstBatchView mean, ConstBatchView covariance, double clock,
                                            double length, std::span<double> out, Scratch& s) const {
  const std::size_t N = mean.nodes();
  rates(mean, covariance, clock, s.mean_rate[0], s.covariance_rate[0], s);
  for_dimension(d_, [&](auto dimension) {
    constexpr int D = decltype(dimension)::value;
    for (std::size_t n = 0; n < N; ++n) {
      const SmallSquare<D> A = square_of<D>(s.slope, d_, n);
      const SmallVector<D> b = vector_of<D>(s.mean_rate[0], d_, n);
      const SmallSquare<D> P = square_of<D>(covariance, d_, n);
      SmallSquare<D> V = SmallSquare<D>::Zero(P.rows(), P.rows());
      for (std::size_t q = 0; q < points_; ++q) {
        SmallVector<D> e = vector_of<D>(s.drift, d_, q * N + n) - b;
        for (std::size_t k = 0; k < d_; ++k)
          e -= coordinate(rule_, k, q) * A.col(static_cast<Eigen::Index>(k));
        V += weight_of(rule_, q) * e * e.transpose();
      }
      const Whitening<D> white(P);
      out[n] = length * std::sqrt(std::max(0.0, (white.whitening * V * white.whitening.transpose()).trace()));
    }
  });
}

void MomentEquations::rate(ConstBatchView mean, double clock, std::span<double> out, Scratch& s) const {
  const std::size_t N = mean.nodes(), D = model_.state_dimension();
  s.points.reshape(D, N);
  for (std::size_t i = 0; i < d_; ++i) std::copy_n(mean.component(i).data(), N, s.points.component(i).data());
  complete(s.points, clock);
  s.diffusion.reshape(D * D, N);
  std::vector<double> drift_only(model_.noise_dimension() + 1, 0.0);
  drift_only[0] = 1;
  model_.fields->jacobian(s.points, drift_only, s.diffusion);
  for (std::size_t n = 0; n < N; ++n) {
    out[n] = 0;
    for (std::size_t i = 0; i < d_; ++i) {
      double sum = 0;
      for (std::size_t l = 0; l < d_; ++l) sum += std::abs(s.diffusion(i * D + l, n));
      out[n] = std::max(out[n], sum);
    }
  }
}

Eigen::MatrixXd MomentEquations::mean_diffusion(const Eigen::VectorXd& m, const Eigen::MatrixXd& P,
                                                double clock, Scratch& s) const {
  s.mean.reshape(d_, 1);
  s.covariance.reshape(d_ * d_, 1);
  put_vector(m, s.mean, 0);
  put_square(P, s.covariance, 0);
  lay_points(s.mean, s.covariance, clock, s);
  s.covariance_rate[0].reshape(d_ * d_, 1);
  clear(s.covariance_rate[0]);
  add_diffusion(1, s.covariance_rate[0], s);
  const auto d = static_cast<Eigen::Index>(d_);
  Eigen::MatrixXd a(d, d);
  for (std::size_t i = 0; i < d_; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      a(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          a(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = s.covariance_rate[0](i * d_ + j, 0);
  return a;
}

}  // namespace wienertree
