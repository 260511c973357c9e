#include "wienertree/filter/posterior.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numeric>

#include "wienertree/filter/marginal.hpp"

#include "wienertree/numeric/random.hpp"

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
      Marginal(m.posterior(), 0).quantiles(levels, q);
      for (std::size_t i = 0; i < levels.size(); ++i) {
        INFO("N " << N << " level " << levels[i]);
        CHECK(q[i] == Approx(sorted_quantile(m, levels[i])).epsilon(1e-9));
      }
    }
}

TEST_CASE("quantiles of atoms at the ends of the range of doubles equal those of the sorted definition") {
  constexpr double inf = std::numeric_limits<double>::infinity(), tiny = 5e-324, huge = 1.7e308;
  const std::vector<std::vector<double>> places = {
      {0, tiny},                       // the width's reciprocal overflows
      {0, tiny, 3 * tiny, 1e-320},     // nodes of an extinct population
      {-huge, 0, huge},                // the width overflows
      {-huge, huge},                   // so does the gap between neighbours
      {-huge, -1, 1, huge, 1e308, 5},  // the same, with atoms between
      {tiny, tiny},
      {huge, huge, huge}};
  for (const std::vector<double>& x : places) {
    Measure m{Batch(1, x.size()), std::vector<double>(x.size(), 1.0 / static_cast<double>(x.size())), {}};
    std::copy(x.begin(), x.end(), m.points.component(0).begin());
    const std::vector<double> levels = {0.05, 0.5, 0.95};
    std::vector<double> q(levels.size());
    Marginal(m.posterior(), 0).quantiles(levels, q);
    std::vector<double> sorted = x;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < levels.size(); ++i) {
      INFO("atoms from " << sorted.front() << " to " << sorted.back() << ", level " << levels[i]);
      CHECK((q[i] >= sorted.front() && q[i] <= sorted.back()));
      // Midpoints (k + 1/2)/n of the distribution function, linear between; halves do not overflow.
      const double position =
          std::clamp(levels[i] * static_cast<double>(x.size()) - 0.5, 0.0, static_cast<double>(x.size() - 1));
      const auto k = std::min(static_cast<std::size_t>(position), x.size() - 1);
      const double f = position - static_cast<double>(k), above = sorted[std::min(k + 1, x.size() - 1)];
      const double half = sorted[k] / 2 * (1 - f) + above / 2 * f;
      // Subnormal numbers are multiples of 5e-324, each of the two sums rounds to one.
      CHECK(std::fabs(q[i] / 2 - half) <= 1e-12 * std::fabs(half) + 2 * tiny);
    }
  }
  // A node that was dropped may have a state that is no number, and has no weight.
  Measure m{Batch(1, 3), {0.5, 0, 0.5}, {}};
  m.points(0, 0) = 1;
  m.points(0, 1) = std::numeric_limits<double>::quiet_NaN();
  m.points(0, 2) = 2;
  std::vector<double> q(1);
  Marginal(m.posterior(), 0).quantiles(std::vector{0.5}, q);
  CHECK(q[0] == Approx(1.5));
  m.points(0, 1) = inf;
  Marginal(m.posterior(), 0).quantiles(std::vector{0.5}, q);
  CHECK(q[0] == Approx(1.5));
}

TEST_CASE("a summary that would hold a number that is not finite is refused, with time and state") {
  Measure m{Batch(2, 2), {0.5, 0.5}, {}};
  m.points(1, 0) = -1.7e308;
  m.points(1, 1) = 1.7e308;
  Posterior p = m.posterior();
  p.time = 3;
  PosteriorSummary s;
  CHECK_THROWS_WITH(summarise(p, 2, 0, s), Catch::Contains("t = 3, standard deviation of state 2") &&
                                               Catch::Contains("not a finite number"));
  p.log_evidence = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(summarise(p, 2, 0, s), Catch::Contains("log evidence"));
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
  const Marginal law(p, 0);
  law.quantiles(std::vector{0.3}, q);
  // The trapezoidal rule on a smooth decaying integrand is exact to rounding at this spacing.
  const double dx = 0.005;
  for (double x = -25; x < 25; x += dx)
    for (int k = 0; k < 5; ++k) moment[k] += dx * std::pow(x, k) * law.density(x);
  for (double x = -25 + dx / 2; x < q[0]; x += dx) below += dx * law.density(x);
  CHECK(moment[0] == Approx(1).epsilon(1e-10));
  for (int k = 1; k < 5; ++k) CHECK(raw_moment(p, 0, k) == Approx(moment[k]).epsilon(1e-9));
  CHECK(mean(p, 0) == Approx(moment[1]));
  CHECK(covariance(p, 0, 0) == Approx(moment[2] - moment[1] * moment[1]));
  CHECK(below == Approx(0.3).margin(dx));
  CHECK(law.distribution(q[0]) == Approx(0.3).epsilon(1e-10));
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

TEST_CASE("families are spread: mean and variance stay, the staircase goes") {
  // One step of degree 5 from a lattice of nodes under N(0,1): the children lie on a lattice again, spacing
  // 0.5.
  constexpr std::size_t parents = 41;
  Measure m{Batch(1, 3 * parents), std::vector<double>(3 * parents), {}};
  const double s = 0.25 / 3, jump = std::sqrt(3 * s), weights[3] = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  double sum = 0;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t n = 0; n < parents; ++n) {
      const double x = (static_cast<double>(n) - 20) * jump;
      m.points(0, j * parents + n) = x + (static_cast<double>(j) - 1) * jump;
      sum += m.weight[j * parents + n] = weights[j] * std::exp(-x * x / 2);
    }
  for (double& w : m.weight) w /= sum;
  Posterior p = m.posterior();
  p.parents = parents;
  const Marginal law(p, 0);
  const double sd = std::sqrt(1 + s);
  // The trapezoidal sum of Gaussians of spacing 0.5 and sd sqrt(1/12) = 0.289: ripple 2 exp(-2 pi^2
  // (0.289/0.5)^2) = 2.8e-3 of the density.
  for (const double x : {-2.0, -0.7, 0.1, 1.3}) {
    const double exact = std::exp(-x * x / (2 * sd * sd)) / (sd * std::sqrt(2 * 3.14159265358979));
    CHECK(law.density(x) == Approx(exact).epsilon(4e-3));
    CHECK(law.distribution(x) == Approx(std::erfc(-x / sd / std::sqrt(2.0)) / 2).margin(5e-4));
  }
  std::vector<double> q(2);
  law.quantiles(std::vector{0.05, 0.95}, q);
  CHECK(q[1] == Approx(1.6448536 * sd).margin(5e-3));
  CHECK(q[0] == Approx(-q[1]).epsilon(1e-9));
}

TEST_CASE("few families: quantiles by their moments, and inside declared bounds") {
  // The law .7 N(-.3, s^2) + .3 N(.7, s^2), each by the three points of Gauss and Hermite: two families of one standard
  // deviation. Its third cumulant moves quantiles by .018 standard deviations.
  const auto families = [](double s) {
    const double root = std::sqrt(3.0), centre[2] = {-0.3, 0.7}, mass[2] = {0.7, 0.3};
    Measure m{Batch(1, 6), std::vector<double>(6), {}};
    for (std::size_t branch = 0; branch < 3; ++branch)
      for (std::size_t parent = 0; parent < 2; ++parent) {
        m.points(0, 2 * branch + parent) = centre[parent] + (static_cast<double>(branch) - 1) * root * s;
        m.weight[2 * branch + parent] = mass[parent] * (branch == 1 ? 2.0 / 3 : 1.0 / 6);
      }
    return m;
  };
  const auto quantile = [](const Measure& m, double level, std::span<const StateBound> bounds) {
    Posterior p = m.posterior();
    p.parents = 2;
    p.bounds = bounds;
    double q = 0;
    Marginal(p, 0).quantiles(std::span(&level, 1), std::span(&q, 1));
    return q;
  };
  const Measure m = families(1);
  const double sd = std::sqrt(1 + 0.7 * 0.3);
  for (const double level : {0.05, 0.5, 0.95}) {
    const double q = quantile(m, level, {});
    const auto Phi = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
    const auto phi = [](double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::acos(-1.0)); };
    const double excess = 0.7 * Phi(q + 0.3) + 0.3 * Phi(q - 0.7) - level;
    CHECK(std::abs(excess) / (0.7 * phi(q + 0.3) + 0.3 * phi(q - 0.7)) < 3e-3 * sd);
  }
  const StateBound bound{-1, 2, Boundary::error};
  CHECK(quantile(m, 0.05, std::span(&bound, 1)) == -1);
  CHECK(quantile(m, 0.95, std::span(&bound, 1)) < 2);
  CHECK(quantile(m, 0.9999, std::span(&bound, 1)) == 2);
  // Two modes are no Gaussian: the families are taken as they are, the lower one's median being at level .35.
  CHECK(quantile(families(0.05), 0.35, {}) == Approx(-0.3).margin(0.02));
}

TEST_CASE("merging many Gaussians keeps the law") {
  constexpr std::size_t N = 20000;
  Measure m{Batch(1, N), std::vector<double>(N, 1.0 / N), Batch(1, 1)};
  RandomStream{4, 0, 0, Purpose::signal_noise}.normals(0, m.points.component(0));
  m.covariance(0, 0) = 0.01;
  const Posterior p = m.posterior();
  const Marginal law(p, 0);
  for (const double x : {-1.5, 0.0, 0.8}) {
    double exact = 0;
    for (std::size_t n = 0; n < N; ++n)
      exact += std::erfc((m.points(0, n) - x) / 0.1 / std::sqrt(2.0)) / 2 / N;
    // Within a cell of width 1/32 sd the mean and variance are kept: error of third order, (1/32)^3/6.
    CHECK(law.distribution(x) == Approx(exact).margin(1e-5));
  }
}
