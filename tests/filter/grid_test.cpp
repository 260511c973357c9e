/// The grid filter against every exact answer there is.
#include "wienertree/filter/grid_filter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "filter/linear_problems.hpp"
#include "filter/text_problems.hpp"
#include "wienertree/filter/benes_filter.hpp"
#include "wienertree/filter/kalman_bucy_filter.hpp"
#include "wienertree/filter/kalman_filter.hpp"
#include "wienertree/filter/marginal.hpp"

using namespace wienertree;

namespace {

FilterOptions grid_options(std::size_t points, double step) {
  FilterOptions o;
  o.method = FilterMethod::grid;
  o.grid_points = points;
  o.grid_step = step;
  return o;
}
const FilterOptions defaults = grid_options(FilterOptions{}.grid_points, FilterOptions{}.grid_step);

Model scalar(const std::string& drift, const std::string& diffusion, const std::string& observation,
             const std::string& state = "{ initial = 0.3 }") {
  return parse_model("name = \"m\"\nconvention = \"ito\"\n[state]\nx = " + state + "\n[drift]\nx = \"" +
                         drift + "\"\n[diffusion]\nx = [" + diffusion + "]\n" + observation,
                     "m.toml", {});
}
const std::string seen = "[observation]\nkind = \"continuous\"\nh = [\"2*x\"]\n";

struct Errors {
  double mean = 0, sd = 0, quantile = 0, evidence = 0;
};

// The largest differences over the windows.
Errors compare(Filter& filter, Filter& exact, const Model& model, const ObservationPath& path,
               std::size_t steps) {
  const ObservationWindows windows(path, model.observation, model.timing, steps);
  ObservationWindow w;
  PosteriorSummary s, t;
  Errors e;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, w);
    filter.advance(w);
    exact.advance(w);
    summarise(filter.posterior(), 1, 0, s);
    summarise(exact.posterior(), 1, 0, t);
    e.mean = std::max(e.mean, std::abs(s.mean[0] - t.mean[0]));
    e.sd = std::max(e.sd, std::abs(s.sd[0] - t.sd[0]));
    e.quantile = std::max({e.quantile, std::abs(s.q05[0] - t.q05[0]), std::abs(s.q95[0] - t.q95[0])});
    e.evidence = std::max(e.evidence, std::abs(s.log_evidence - t.log_evidence));
  }
  return e;
}

Errors benes_errors(const BenesCase& c, std::size_t rows, const FilterOptions& options) {
  const Model model = c.model();
  const auto path = simulate(model, c.horizon, 20'000, rows, 5).observations;
  const auto filter = make_filter(model, options);
  BenesFilter exact(model);
  return compare(*filter, exact, model, path, 20);
}

const Posterior& prior_law(Filter& filter, double time) {
  ObservationWindow w;
  w.step = 1;
  w.end = time;
  filter.advance(w);
  return filter.posterior();
}

}  // namespace

TEST_CASE("grid filter: Benes' problems A to D to 1e-8, from a fixed start") {
  for (const BenesCase& c : benes_cases) {
    const Errors e = benes_errors(c, 2000, defaults);
    INFO("problem " << c.name << ": " << e.mean << ' ' << e.sd << ' ' << e.quantile << ' ' << e.evidence);
    CHECK(e.mean < 1e-8);
    CHECK(e.sd < 1e-8);
    CHECK(e.quantile < 1e-7);
    // BenesFilter's own evidence is by Simpson's rule, (c gap)^4 gap |Y'|^2/2880 a gap: 3e-8 on problem C.
    CHECK(e.evidence < 1e-7);
  }
}

TEST_CASE("grid filter: order 8 in the width of a cell") {
  // Problem A has the sharpest drift for its density. The grid is laid by what it sees, so that single errors
  // are not on one line; 2^8 = 256 over a factor of two.
  const double coarse = benes_errors(benes_cases[0], 500, grid_options(120, 0.25)).mean,
               fine = benes_errors(benes_cases[0], 500, grid_options(240, 0.25)).mean;
  INFO(coarse << " -> " << fine);
  CHECK(coarse < 1e-4);
  CHECK(coarse / fine > std::exp2(7));
}

TEST_CASE("grid filter: order 4 in the length of a step") {
  const Model model = scalar("-x", "0.7", seen);
  const auto path = simulate(model, 4, 4000, 8, 5).observations;
  const auto errors = [&](double step) {
    const auto filter = make_filter(model, grid_options(400, step));
    KalmanBucyFilter exact(model);
    return compare(*filter, exact, model, path, 0);
  };
  const Errors coarse = errors(1), fine = errors(0.25);
  INFO(coarse.mean << " -> " << fine.mean << ", " << coarse.evidence << " -> " << fine.evidence);
  CHECK(std::log2(coarse.mean / fine.mean) / 2 == Approx(4).margin(0.3));
  CHECK(std::log2(coarse.evidence / fine.evidence) / 2 == Approx(4).margin(0.3));
  CHECK(fine.evidence < 1e-6);
}

TEST_CASE(
    "grid filter: the windows' division does not matter, and several sensors and Brownian motions add up") {
  // Two sensors h = x and 2x + 0.1 and two Brownian motions, against Kalman-Bucy; random start.
  LinearProblem l(1, 2, 2, 7);
  const Model model = l.model("kind = \"continuous\"", true);
  const auto path = simulate(model, 3, 3000, 600, 4).observations;
  for (const std::size_t steps : {1, 7, 600}) {
    const auto filter = make_filter(model, defaults);
    KalmanBucyFilter exact(model);
    const Errors e = compare(*filter, exact, model, path, steps);
    CHECK(e.mean < 1e-8);
    CHECK(e.sd < 1e-8);
    CHECK(e.evidence < 1e-7);
  }
}

TEST_CASE("grid filter: the same problem in bent coordinates") {
  // dX = -X dt + 0.7 dB, h = 2x, as Z = sinh X: dZ = (-X cosh X + 0.245 sinh X) dt + 0.7 cosh X dB, h = 2
  // asinh z. The evidence is a number of the problem, not of its coordinates, and E[asinh Z] = E[X].
  const std::string asinh = "log(x + sqrt(x^2 + 1))";
  const Model straight = scalar("-x", "0.7", seen),
              bent = scalar("-" + asinh + "*sqrt(x^2 + 1) + 0.245*x", "\"0.7*sqrt(x^2 + 1)\"",
                            "[observation]\nkind = \"continuous\"\nh = [\"2*" + asinh + "\"]\n",
                            "{ initial = 0.30452029344714261 }");
  const auto path = simulate(straight, 2, 4000, 400, 5).observations;
  const auto filter = make_filter(bent, defaults);
  KalmanBucyFilter exact(straight);
  for (Filter* f : {filter.get(), static_cast<Filter*>(&exact)})
    run(*f, ObservationWindows(path, bent.observation, bent.timing, 0), {});
  const Posterior& p = filter->posterior();
  double mean_x = 0;  // of each Gaussian to fourth order: E f = f + w^2/2 f'' + w^4/8 f'''', f = asinh
  for (std::size_t n = 0; n < p.size(); ++n) {
    const double z = p.points(0, n), w2 = p.variance_of(0, n), r = 1 + z * z;
    mean_x += p.weight[n] * (std::asinh(z) - w2 / 2 * z / std::pow(r, 1.5) +
                             w2 * w2 / 8 * (9 * z - 6 * z * z * z) / std::pow(r, 3.5));
  }
  CHECK(p.log_evidence == Approx(exact.posterior().log_evidence).margin(1e-7));
  CHECK(mean_x == Approx(mean(exact.posterior(), 0)).margin(1e-7));
}

TEST_CASE("grid filter: the prior law of Benes' problem A, its moments and its density") {
  Model model = benes_cases[0].model();
  model.observation = ObservationKind::none;
  const auto filter = make_filter(model, defaults);
  const Posterior& p = prior_law(*filter, 8.3);
  const double m = 2.2 * 2.2 * 8.3;  // means +- m, variance m
  CHECK(mean(p, 0) == Approx(0).margin(1e-8));
  CHECK(raw_moment(p, 0, 2) == Approx(m * m + m).epsilon(1e-9));
  CHECK(raw_moment(p, 0, 4) == Approx(m * m * m * m + 6 * m * m * m + 3 * m * m).epsilon(1e-8));
  CHECK(p.log_evidence == Approx(0).epsilon(0).margin(1e-9));
  const Marginal law(p, 0);
  for (const double x : {-60.0, -40.0, -20.0, 0.0, 35.0, 47.0}) {
    const double exact = (std::exp(-(x - m) * (x - m) / (2 * m)) + std::exp(-(x + m) * (x + m) / (2 * m))) /
                         (2 * std::sqrt(2 * std::numbers::pi * m));
    CHECK(law.density(x) == Approx(exact).margin(1e-8));
  }
}

TEST_CASE("grid filter: diffusions that depend on the state") {
  // Geometric Brownian motion: E[X^k] = exp(k mu t + k (k-1) sigma^2 t/2).
  const auto gbm = make_filter(scalar("0.1*x", "\"0.2*x\"", "", "{ initial = 1.0 }"), defaults);
  const Posterior& p = prior_law(*gbm, 1);
  for (const int k : {1, 2, 3})
    CHECK(raw_moment(p, 0, k) == Approx(std::exp(0.1 * k + 0.02 * k * (k - 1))).epsilon(1e-7));
  // Square-root process: mean theta + (r - theta) e, e = exp(-kappa t), variance
  // r sigma^2/kappa (e - e^2) + theta sigma^2/(2 kappa) (1 - e)^2. Its density vanishes at the bound like x^4
  // (2 kappa theta/sigma^2 = 5), which bounds the order there.
  const auto cir =
      make_filter(scalar("2*(0.2 - x)", "\"0.4*sqrt(x)\"", "", "{ initial = 0.09, lower = 0.0 }"), defaults);
  const Posterior& q = prior_law(*cir, 1);
  const double e = std::exp(-2.0), exact = 0.2 - 0.11 * e;
  CHECK(mean(q, 0) == Approx(exact).epsilon(1e-5));
  CHECK(covariance(q, 0, 0) ==
        Approx(0.09 * 0.08 * (e - e * e) + 0.2 * 0.04 * (1 - e) * (1 - e)).epsilon(1e-3));
}

TEST_CASE("grid filter: a bound that the signal reaches reflects it") {
  // |0.5 + B|: mean sqrt(2 t/pi) exp(-x^2/(2t)) + x erf(x/sqrt(2t)), second moment x^2 + t.
  const auto filter =
      make_filter(scalar("0", "1", "", "{ initial = 0.5, lower = 0.0, boundary = \"clamp\" }"), defaults);
  const Posterior& p = prior_law(*filter, 1);
  CHECK(mean(p, 0) ==
        Approx(std::sqrt(2 / std::numbers::pi) * std::exp(-0.125) + 0.5 * std::erf(0.5 / std::sqrt(2)))
            .epsilon(1e-4));
  CHECK(raw_moment(p, 0, 2) == Approx(1.25).epsilon(1e-6));
}

TEST_CASE("grid filter: a double well keeps its stationary law") {
  // Density proportional to exp(2 (2 x^2 - x^4)/0.64) in the limit; relaxation within a well takes 1/8.
  const auto filter = make_filter(scalar("4*x - 4*x^3", "0.8", "", "{ initial = 0.0 }"), defaults);
  const Marginal law(prior_law(*filter, 20), 0);
  const auto potential = [](double x) { return 2 * (2 * x * x - x * x * x * x) / 0.64; };
  for (const double x : {0.0, 0.5, 1.3, -1.5})
    CHECK(std::log(law.density(x) / law.density(1)) == Approx(potential(x) - potential(1)).margin(1e-5));
}

TEST_CASE("grid filter: discrete observations of a linear signal are the Kalman filter's") {
  const double gone = std::numeric_limits<double>::quiet_NaN();
  for (const bool previous : {false, true})
    for (const bool random_start : {false, true}) {
      LinearProblem l(1, 2, 2, 12);
      const Model model =
          l.model(std::string("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 0.4 }\ntiming = \"") +
                      (previous ? "previous\"" : "current\""),
                  random_start);
      ObservationPath path;
      path.dimension = 2;
      path.append(0, std::vector{previous ? gone : 0.5, previous ? gone : -0.2});
      path.append(0.1, std::vector{0.3, gone});
      path.append(0.5, std::vector{gone, gone});
      path.append(3.0, std::vector{1.0, 0.4});
      path.append(3.01, std::vector{-0.4, 0.1});
      for (const std::size_t steps : {0, 50}) {
        const auto filter = make_filter(model, defaults);
        KalmanFilter exact(model);
        const Errors e = compare(*filter, exact, model, path, steps);
        INFO(previous << random_start << steps << ": " << e.mean << ' ' << e.sd << ' ' << e.evidence);
        CHECK(e.mean < 1e-8);
        CHECK(e.sd < 1e-8);
        CHECK(e.evidence < 1e-8);
      }
    }
}

TEST_CASE("grid filter: noise that is not Gaussian, against quadrature of the transition density") {
  // X_{t+1} = X_t + N(0, 0.3), X_0 ~ N(0, 2). Trapezoidal sums on [-25, 25] with spacing 1/40: exact to
  // rounding for Student's t, whose density is analytic; Laplace's kink lies on a node.
  const std::vector<double> y = {0.4, -1.5, 6.0, 0.2, 0.3};
  const auto log_likelihood = [&](auto log_density) {
    constexpr int n = 2001;
    const auto node = [](int i) { return (i - 1000) / 40.0; };
    const auto normal = [](double x, double v) {
      return std::exp(-x * x / (2 * v)) / std::sqrt(2 * std::numbers::pi * v);
    };
    std::vector<double> rho(n), next(n);
    for (int i = 0; i < n; ++i) rho[i] = normal(node(i), 2) * std::exp(log_density(y[0] - node(i)));
    for (std::size_t t = 1; t < y.size(); ++t) {
      for (int i = 0; i < n; ++i) {
        next[i] = 0;
        for (int j = std::max(0, i - 200); j < std::min(n, i + 201); ++j)
          next[i] += rho[j] * normal(node(i) - node(j), 0.3) / 40;
        next[i] *= std::exp(log_density(y[t] - node(i)));
      }
      rho.swap(next);
    }
    double sum = 0;
    for (const double r : rho) sum += r / 40;
    return std::log(sum);
  };
  const auto filtered = [&](const std::string& noise, std::size_t points) {
    Model model = scalar("0", "\"sqrt(0.3)\"",
                         "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = " + noise + "\n");
    model.initial_law = InitialLaw{Eigen::VectorXd::Zero(1), Eigen::MatrixXd::Constant(1, 1, 2.0)};
    const ObservationPath path{1, {0, 1, 2, 3, 4}, y};
    FilterOptions options = defaults;
    options.grid_points = points;
    const auto filter = make_filter(model, options);
    double variance = 0;
    run(*filter, ObservationWindows(path, model.observation, model.timing, 0),
        [&](const Posterior& p) { variance = std::max(variance, p.variance_of(0, 0)); });
    return std::pair(filter->posterior().log_evidence, variance);
  };
  // Student's t with 4 degrees of freedom and scale 0.7: density 3/8 (1 + v^2/(4 s^2))^{-5/2} / s.
  CHECK(filtered("{ law = \"student-t\", dof = 4, scale = 0.7 }", 400).first ==
        Approx(log_likelihood([](double v) {
          return std::log(0.375 / 0.7) - 2.5 * std::log1p(v * v / (4 * 0.49));
        })).margin(1e-8));
  const double laplace = log_likelihood([](double v) { return -std::abs(v) / 0.5; });
  // A kink in a cell of width w costs the sum at most w^2/12 times the jump of the derivative, 2/0.5 times
  // the density there, which is about the integral itself: w^2/3 for each of the five observations.
  for (const std::size_t points : {400, 1600}) {
    const auto [evidence, variance] = filtered("{ law = \"laplace\", scale = 0.5 }", points);
    CHECK(evidence == Approx(laplace).margin(5 * variance / 3));
    CHECK(5 * variance / 3 < (points == 400 ? 1.6e-2 : 1e-3));
  }
}

TEST_CASE("grid filter: a likelihood ten thousand times as narrow as the prior") {
  Model model =
      scalar("0", "1",
             "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.001 }\n");
  model.initial_law = InitialLaw{Eigen::VectorXd::Constant(1, 5.0), Eigen::MatrixXd::Constant(1, 1, 100.0)};
  const ObservationPath path{1, {0.0, 1e-4, 1.0}, {7.0, 7.01, 8.0}};
  const auto filter = make_filter(model, defaults);
  KalmanFilter exact(model);
  const Errors e = compare(*filter, exact, model, path, 0);
  CHECK(e.mean < 1e-9);
  CHECK(e.sd < 1e-9);
  CHECK(e.evidence < 1e-8);
}

TEST_CASE("grid filter: the Nile") {
  const std::string root = std::string(WIENERTREE_SOURCE_DIR) + "/data/";
  const Model model = load_model(root + "models/nile.toml");
  const auto path = read_observations(root + "observations/nile.csv", 1, ObservationKind::discrete);
  const auto filter = make_filter(model, defaults);
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  CHECK(filter->posterior().log_evidence == Approx(-641.585578).margin(1e-6));
  CHECK(mean(filter->posterior(), 0) == Approx(798.36911).margin(1e-5));
  CHECK(covariance(filter->posterior(), 0, 0) == Approx(4032.08089).margin(1e-5));
}

TEST_CASE("grid filter: stochastic volatility of the DAX") {
  // Log-likelihoods by an independent quadrature of the autoregression's transition density.
  const std::string root = std::string(WIENERTREE_SOURCE_DIR) + "/data/";
  const auto path = read_observations(root + "observations/dax.csv", 1, ObservationKind::discrete);
  REQUIRE(path.rows() == 1859);
  const auto log_likelihood = [&](double phi, double s, double beta) {
    const Model model =
        load_model(root + "models/stochastic-volatility.toml", {{"phi", phi}, {"s", s}, {"beta", beta}});
    const auto filter = make_filter(model, defaults);
    run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
    return filter->posterior().log_evidence;
  };
  CHECK(log_likelihood(0.97, 0.2, 0.9) == Approx(-2511.197502).margin(1e-5));
  CHECK(log_likelihood(0.95, 0.3, 0.7) == Approx(-2520.781821).margin(1e-5));
}
