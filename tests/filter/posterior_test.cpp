#include "wienertree/filter/posterior.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "wienertree/tree/random.hpp"

using namespace wienertree;

namespace {

struct Measure {
  Batch points;
  std::vector<double> weight;
  Batch covariance;
  Posterior posterior() const {
    Posterior p;
    p.points = points;
    p.weight = weight;
    if (covariance.components() > 0) p.covariance = covariance;
    p.kept = weight.size();
    return p;
  }
};

Measure random_atoms(std::size_t N, std::uint32_t seed, double outlier) {
  Measure m{Batch(1, N), std::vector<double>(N), {}};
  RandomStream{seed, 0, 0, Purpose::signal_noise}.normals(0, m.points.component(0));
  RandomStream{seed, 0, 1, Purpose::signal_noise}.uniforms(0, m.weight);
  m.points(0, N / 2) = outlier;
  const double sum = std::accumulate(m.weight.begin(), m.weight.end(), 0.0);
  for (double& w : m.weight) w /= sum;
  return m;
}

// The definition: sort, distribution function through the midpoints, linear between.
double sorted_quantile(const Measure& m, double level) {
  std::vector<std::size_t> order(m.weight.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return m.points(0, a) < m.points(0, b); });
  double before = 0, x0 = m.points(0, order[0]), f0 = -1;
  for (const std::size_t n : order) {
    const double f = before + m.weight[n] / 2, x = m.points(0, n);
    if (f >= level) return f0 < 0 ? x : x0 + (x - x0) * (level - f0) / (f - f0);
    before += m.weight[n];
    x0 = x;
    f0 = f;
  }
  return x0;
}

}  // namespace

TEST_CASE("quantiles of atoms equal those of the sorted definition") {
  for (const std::size_t N : {1, 2, 3, 10, 1000, 5000})
    for (const double outlier : {0.1, 1e9}) {
      const Measure m = random_atoms(N, static_cast<std::uint32_t>(N), outlier);
      const std::vector<double> levels = {0.001, 0.05, 0.5, 0.95, 0.999};
      std::vector<double> q(levels.size());
      quantiles(m.posterior(), 0, levels, q);
      for (std::size_t i = 0; i < levels.size(); ++i) {
        INFO("N " << N << " level " << levels[i]);
        CHECK(q[i] == Approx(sorted_quantile(m, levels[i])).epsilon(1e-9));
      }
    }
}

TEST_CASE("moments, quantiles and density of a Gaussian sum agree with quadrature") {
  Measure m{Batch(1, 2), {0.3, 0.7}, Batch(1, 2)};
  m.points(0, 0) = -1;
  m.points(0, 1) = 2;
  m.covariance(0, 0) = 0.25;
  m.covariance(0, 1) = 1.5;
  const Posterior p = m.posterior();
  double moment[5] = {}, below = 0;
  std::vector<double> q(1);
  quantiles(p, 0, std::vector{0.3}, q);
  // The trapezoidal rule on a smooth decaying integrand is exact to rounding at this spacing.
  const double dx = 0.005;
  for (double x = -25; x < 25; x += dx)
    for (int k = 0; k < 5; ++k) moment[k] += dx * std::pow(x, k) * density(p, 0, x);
  for (double x = -25 + dx / 2; x < q[0]; x += dx) below += dx * density(p, 0, x);
  CHECK(moment[0] == Approx(1).epsilon(1e-10));
  for (int k = 1; k < 5; ++k) CHECK(raw_moment(p, 0, k) == Approx(moment[k]).epsilon(1e-9));
  CHECK(mean(p, 0) == Approx(moment[1]));
  CHECK(covariance(p, 0, 0) == Approx(moment[2] - moment[1] * moment[1]));
  CHECK(below == Approx(0.3).margin(dx));
  CHECK(distribution(p, 0, q[0]) == Approx(0.3).epsilon(1e-12));
}

TEST_CASE("a summary gathers what each function gives") {
  const Measure m = random_atoms(50, 9, 0.4);
  const Posterior p = m.posterior();
  PosteriorSummary s;
  summarise(p, 1, 4, s);
  CHECK(s.mean[0] == mean(p, 0));
  CHECK(s.sd[0] == std::sqrt(covariance(p, 0, 0)));
  CHECK(s.ess == effective_sample_size(p));
  CHECK(s.moments[0].size() == 3);
  CHECK(s.moments[0][2] == raw_moment(p, 0, 4));
  CHECK((s.q05[0] < s.q50[0] && s.q50[0] < s.q95[0]));
}
