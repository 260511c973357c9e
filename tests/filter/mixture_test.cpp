/// The Gaussian-mixture filter, its quadrature and its conditioning.
#include "wienertree/filter/gaussian_mixture_filter.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "allocations.hpp"
#include "filter/linear_problems.hpp"
#include "filter/text_problems.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/model/observation_density.hpp"

using namespace wienertree;

namespace {

FilterOptions mixture(std::size_t nodes, double alpha, double beta = 0) {
  FilterOptions o;
  o.method = FilterMethod::gaussian_mixture;
  o.nodes = nodes;
  o.alpha = alpha;
  o.beta = beta;
  return o;
}

Model brownian() {
  return parse_model(
      "name = \"b\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.5 }\n[drift]\nx = 0\n[diffusion]\nx = "
      "[\"1.5\"]\n",
      "b.toml");
}

// Two Gaussians in R^2, of weights 0.3 and 0.7.
struct TwoGaussians {
  Batch points{2, 2}, covariance{4, 2};
  std::vector<double> weight = {0.3, 0.7};
  Posterior posterior;
  TwoGaussians() {
    const double m[2][2] = {{0.4, -1.0}, {2.0, 0.3}},
                 c[4][2] = {{0.5, 2.0}, {0.2, -0.6}, {0.2, -0.6}, {0.3, 0.4}};
    for (std::size_t n = 0; n < 2; ++n) {
      for (std::size_t i = 0; i < 2; ++i) points(i, n) = m[i][n];
      for (std::size_t i = 0; i < 4; ++i) covariance(i, n) = c[i][n];
    }
    posterior.points = points;
    posterior.weight = weight;
    posterior.covariance = covariance;
  }
};

ObservationWindow step_of(std::size_t number, double length) {
  ObservationWindow w;
  w.step = number;
  w.start = length * static_cast<double>(number - 1);
  w.end = length * static_cast<double>(number);
  return w;
}

}  // namespace

TEST_CASE("Gauss-Hermite rules integrate polynomials up to degree 2n - 1") {
  for (const int n : {1, 3, 5, 7, 11})
    for (const int d : {1, 2})
      // The largest moment of degree 20 is 6.5e8, computed to some eps.
      CHECK(max_monomial_error(gauss_hermite(d, n), std::min(2 * n - 1, 11)) < 1e-10);
  for (int d = 1; d <= 20; ++d) {
    const GaussianCubature rule = rule_of_one_gaussian(d);
    CHECK(rule.weights.sum() == Approx(1).epsilon(1e-12));
    if (d <= 16) CHECK(max_monomial_error(rule, d <= 6 ? 5 : 3) < 1e-10);
  }
}

TEST_CASE("expectations under a sum of Gaussians: moments to degree 4, and any function by quadrature") {
  TwoGaussians g;
  const auto moment = [&](int i, int order) {
    return expectation(g.posterior, [&](ConstBatchView x, std::span<double> out) {
      for (std::size_t n = 0; n < out.size(); ++n)
        out[n] = std::pow(x(static_cast<std::size_t>(i), n), order);
    });
  };
  for (const int i : {0, 1})
    for (const int order : {1, 2, 3, 4})
      CHECK(moment(i, order) ==
            Approx(raw_moment(g.posterior, static_cast<std::size_t>(i), order)).epsilon(1e-12));
  // E X^4 of N(m, v) = m^4 + 6 m^2 v + 3 v^2, by hand for the first component.
  const auto fourth = [](double m, double v) { return m * m * m * m + 6 * m * m * v + 3 * v * v; };
  CHECK(raw_moment(g.posterior, 0, 4) ==
        Approx(0.3 * fourth(0.4, 0.5) + 0.7 * fourth(-1.0, 2.0)).epsilon(1e-13));
  const double product = expectation(g.posterior, [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = x(0, n) * x(1, n);
  });
  CHECK(product - mean(g.posterior, 0) * mean(g.posterior, 1) ==
        Approx(covariance(g.posterior, 0, 1)).epsilon(1e-12));
  // E exp(a.X) = exp(a.m + a.om a/2). The rule of 7 points an axis misses terms of degree 14: (a.om a)^7/14!
  // of the value, 2e-9 with a.om a < 0.7.
  const double a = 0.5, b = 0.4;
  const double value = expectation(g.posterior, [&](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::exp(a * x(0, n) + b * x(1, n));
  });
  double exact = 0;
  for (std::size_t n = 0; n < 2; ++n)
    exact +=
        g.weight[n] *
        std::exp(a * g.points(0, n) + b * g.points(1, n) +
                 (a * a * g.covariance(0, n) + 2 * a * b * g.covariance(1, n) + b * b * g.covariance(3, n)) /
                     2);
  CHECK(value == Approx(exact).epsilon(1e-8));
}

TEST_CASE("conditioning a Gaussian on a linear observation is Kalman's update") {
  // Two states, two sensors with noise variances 4 and 2.25 beside a predicted variance of at most 0.4.
  const LinearProblem problem(2, 2, 2, 3);
  const Model model = problem.model(
      "kind = \"discrete\"\nnoise = [{ law = \"gaussian\", sd = 2.0 }, { law = \"gaussian\", sd = 1.5 }]",
      false);
  Batch v(2, 1), covariance(4, 1);
  const Eigen::Matrix2d P = (Eigen::Matrix2d() << 0.3, 0.1, 0.1, 0.4).finished();
  const Eigen::Vector2d m(0.2, -0.7);
  for (std::size_t i = 0; i < 2; ++i) {
    v(i, 0) = m(static_cast<Eigen::Index>(i));
    for (std::size_t j = 0; j < 2; ++j)
      covariance(i * 2 + j, 0) = P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  std::vector<double> log_weight = {-1.5};
  GaussianConditioning conditioning;
  const Eigen::Vector2d y(1.0, -0.5);
  conditioning.condition(*model.density, rule_of_one_gaussian(2), {y.data(), 2}, v, covariance, log_weight);
  const Eigen::Matrix2d R = Eigen::Vector2d(4.0, 2.25).asDiagonal(),
                        S = problem.H * P * problem.H.transpose() + R;
  const Eigen::Vector2d e = y - problem.H * m - problem.c;
  const Eigen::Matrix2d K = P * problem.H.transpose() * S.inverse(), P1 = P - K * problem.H * P;
  const Eigen::Vector2d m1 = m + K * e;
  // The rule of 7 points an axis is exact to degree 13; the likelihood's term of degree 14 is of the size of
  // (0.2)^7.
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(v(i, 0) == Approx(m1(static_cast<Eigen::Index>(i))).margin(1e-5));
    for (std::size_t j = 0; j < 2; ++j)
      CHECK(covariance(i * 2 + j, 0) ==
            Approx(P1(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j))).margin(1e-5));
  }
  const double exact =
      -1.5 - 0.5 * std::log((2 * std::numbers::pi * S).determinant()) - 0.5 * e.dot(S.inverse() * e);
  CHECK(log_weight[0] == Approx(exact).margin(1e-5));
}

TEST_CASE(
    "the mixture of a Brownian signal keeps its variance, and beta adds alpha beta at each correction") {
  constexpr std::size_t N = 20'000, steps = 10;
  for (const double alpha : {0.0, 0.3, 1.0})
    for (const double beta : {0.0, 0.4}) {
      const auto filter = make_filter(brownian(), mixture(N, alpha, beta));
      for (std::size_t j = 1; j <= steps; ++j) filter->advance(step_of(j, 0.2));
      const Posterior& p = filter->posterior();
      // The start's alpha beta and one more at each of the steps - 1 corrections.
      const double variance = 2.25 * 2 + static_cast<double>(steps) * alpha * beta;
      // Null hypothesis: means and covariances of N independent Gaussians of that total variance. The mean
      // has the standard deviation sqrt(variance/N) at most, the variance variance sqrt(2/N); |z| > 6 has
      // probability 2e-9, 12 of them.
      INFO("alpha " << alpha << ", beta " << beta);
      CHECK(std::abs(mean(p, 0) - 0.5) < 6 * std::sqrt(variance / N));
      CHECK(std::abs(covariance(p, 0, 0) - variance) < 6 * variance * std::sqrt(2.0 / N));
      CHECK(p.dirac() == (alpha == 0));
      CHECK(p.log_evidence == Approx(0).epsilon(0).margin(1e-12));
    }
}

TEST_CASE("the mixture of a linear signal in three dimensions agrees with the Kalman filter") {
  const LinearProblem problem(3, 2, 2, 11);
  const Model model = problem.model("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1.0 }", true);
  ObservationPath path = simulate(model, 3, 3000, 12, 4).observations;
  path.values[6] = NAN;  // one component of a row
  path.values[8] = path.values[9] = NAN;
  FilterOptions exact;
  exact.method = FilterMethod::kalman;
  const auto kalman = make_filter(model, exact);
  run(*kalman, ObservationWindows(path, model.observation, model.timing, 0), {});
  // Euler's error is of order s: 120 steps against 240 tell it.
  constexpr int launches = 20;
  double at[2] = {}, squares = 0;
  for (const int level : {0, 1})
    for (int l = 0; l < launches; ++l) {
      FilterOptions o = mixture(2000, 0.1);
      o.launch = static_cast<std::uint32_t>(l);
      const auto filter = make_filter(model, o);
      run(*filter, ObservationWindows(path, model.observation, model.timing, level == 0 ? 120 : 240), {});
      const double m = mean(filter->posterior(), 0);
      at[level] += m / launches;
      if (level == 1) squares += m * m / launches;
    }
  const double se = std::sqrt((squares - at[1] * at[1]) / (launches - 1));
  INFO("exact " << mean(kalman->posterior(), 0) << ", mixture " << at[0] << ", " << at[1] << " +- " << se);
  // The error at the finer level is about the difference of the two; |t| > 9 on 19 degrees of freedom: 3e-8.
  CHECK(std::abs(at[1] - mean(kalman->posterior(), 0)) < 2 * std::abs(at[1] - at[0]) + 9 * se);
  CHECK(se < 0.02);
}

TEST_CASE("the mixture gives the same bytes for any number of threads, and allocates nothing in a step",
          "[threads]") {
  const Model model = benes_cases[3].model();
  const auto path = simulate(model, 2, 2000, 2000, 2).observations;
  const ObservationWindows windows(path, model.observation, model.timing, 20);
  const auto run_with = [&](unsigned threads) {
    FilterOptions o = mixture(3000, 0.1);
    o.threads = threads;
    const auto filter = make_filter(model, o);
    run(*filter, windows, {});
    const Posterior& p = filter->posterior();
    return std::vector<double>{p.log_evidence, mean(p, 0), raw_moment(p, 0, 3)};
  };
  CHECK(run_with(1) == run_with(3));

  const auto filter = make_filter(model, mixture(3000, 0.1));
  ObservationWindow window;
  for (std::size_t j = 0; j < 10; ++j) {
    windows.get(j, window);
    filter->advance(window);
  }
  windows.get(10, window);
  const std::size_t before = test::allocations();
  filter->advance(window);
  CHECK(test::allocations() - before == 0);
}

TEST_CASE("mixture options that do not fit are refused") {
  const Model model = benes_cases[3].model();
  CHECK_THROWS_WITH(make_filter(model, mixture(10, -0.1)), Catch::Contains("alpha"));
  CHECK_THROWS_WITH(make_filter(model, mixture(10, 1.1)), Catch::Contains("alpha"));
  CHECK_THROWS_WITH(make_filter(model, mixture(10, 0.1, -1)), Catch::Contains("beta"));
  CHECK_THROWS_WITH(make_filter(model, mixture(0, 0.1)), Catch::Contains("nodes"));
  FilterOptions o = mixture(10, 0.1);
  o.thinning.method = ThinningMethod::recombination;
  CHECK_THROWS_WITH(make_filter(model, o), Catch::Contains("thin"));
  o.thinning.method = ThinningMethod::none;
  CHECK_THROWS_WITH(make_filter(model, o), Catch::Contains("thin"));
  o = mixture(10, 0.1);
  o.ess_threshold = 0.5;
  CHECK_THROWS_WITH(make_filter(model, o), Catch::Contains("ess-threshold"));
}
