#include "wienertree/filter/gaussian_conditioning.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/filter/expectation.hpp"

namespace wienertree {
namespace {

double coordinate(const GaussianCubature& rule, std::size_t k, std::size_t q) {
  return rule.points(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(q));
}

std::size_t size_of(const GaussianCubature& rule) { return static_cast<std::size_t>(rule.weights.size()); }

}  // namespace

void GaussianConditioning::condition(const ObservationDensity& density, const GaussianCubature& rule,
                                     std::span<const double> y, BatchView v, BatchView covariance,
                                     std::span<double> log_weight) {
  const std::size_t d = v.components(), N = v.nodes();
  root_.reshape(d * d, N);
  cholesky(covariance, d, root_);
  evaluate(density, rule, y, v);
  sum_moments(rule, d, N);
  for (std::size_t n = 0; n < N; ++n) {
    const auto m = [&](std::size_t k) { return moments_(1 + k, n) / moments_(0, n); };
    const auto centred = [&](std::size_t k, std::size_t l) {
      return moments_(1 + d + std::max(k, l) * d + std::min(k, l), n) / moments_(0, n) - m(k) * m(l);
    };
    const auto L = [&](std::size_t i, std::size_t k) { return root_(i * d + k, n); };
    log_weight[n] += largest_[n] + std::log(moments_(0, n));
    if (!(moments_(0, n) > 0)) continue;
    for (std::size_t i = 0; i < d; ++i) {
      for (std::size_t k = 0; k <= i; ++k) v(i, n) += L(i, k) * m(k);
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k <= i; ++k)
          for (std::size_t l = 0; l <= j; ++l) sum += L(i, k) * centred(k, l) * L(j, l);
        covariance(i * d + j, n) = covariance(j * d + i, n) = sum;
      }
    }
  }
}

void GaussianConditioning::evaluate(const ObservationDensity& density, const GaussianCubature& rule,
                                    std::span<const double> y, ConstBatchView v) {
  const std::size_t d = v.components(), N = v.nodes();
  points_.reshape(d, N);
  log_density_.reshape(size_of(rule), N);
  largest_.assign(N, -INFINITY);
  for (std::size_t q = 0; q < size_of(rule); ++q) {
    for (std::size_t i = 0; i < d; ++i) {
      double* x = points_.component(i).data();
      std::copy_n(v.component(i).data(), N, x);
      for (std::size_t k = 0; k <= i; ++k) {
        const double* L = root_.component(i * d + k).data();
        const double z = coordinate(rule, k, q);
        for (std::size_t n = 0; n < N; ++n) x[n] += L[n] * z;
      }
    }
    const std::span<double> g = log_density_.component(q);
    density.log_density(y, points_, g);
    const double log_w = std::log(rule.weights(static_cast<Eigen::Index>(q)));
    for (std::size_t n = 0; n < N; ++n) {
      g[n] += log_w;
      // A NaN is kept, and becomes the weight's: an error where weights are checked.
      if (!(g[n] <= largest_[n]) && !std::isnan(largest_[n])) largest_[n] = g[n];
    }
  }
}

void GaussianConditioning::sum_moments(const GaussianCubature& rule, std::size_t d, std::size_t N) {
  moments_.reshape(1 + d + d * d, N);
  for (std::size_t c = 0; c < moments_.components(); ++c) std::fill_n(moments_.component(c).data(), N, 0.0);
  part_.resize(N);
  const auto add = [&](std::size_t component, double factor) {
    double* m = moments_.component(component).data();
    for (std::size_t n = 0; n < N; ++n) m[n] += factor * part_[n];
  };
  for (std::size_t q = 0; q < size_of(rule); ++q) {
    const double* g = log_density_.component(q).data();
    for (std::size_t n = 0; n < N; ++n)
      part_[n] = largest_[n] == -INFINITY ? 0.0 : std::exp(g[n] - largest_[n]);
    add(0, 1);
    for (std::size_t k = 0; k < d; ++k) {
      add(1 + k, coordinate(rule, k, q));
      for (std::size_t l = 0; l <= k; ++l)
        add(1 + d + k * d + l, coordinate(rule, k, q) * coordinate(rule, l, q));
    }
  }
}

}  // namespace wienertree
