/// Error of thinning against N (linear-3d): a damped rotation in R^3, p = 2, k = 2, T 5, degree 5,
/// second-order, n = 50, one observation path simulated by Euler on 10^5 steps. Source of truth: Kalman-Bucy
/// for mean, covariance and the moments 1 to 4 of x1, which are Gaussian; the table shows what thinning and
/// steps do together. For the slopes it is the spread over launches, which thinning alone makes. Criterion,
/// spatial order, TBBA: least-squares slope of log(sd over launches) against log N at most -0.9 in d = 1
/// (Benes, problem C's parameters, T 5, n = 20), at most -0.6 in d = 2 (a rotation) and in d = 3.
/// Recombination with 600 nodes: error of the means below 2e-3, and below that of TBBA with 8000.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/catalogue.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

const char* const rotation = R"TOML(
name = "rotation"
convention = "ito"
[state]
x1 = { initial = 0.5 }
x2 = { initial = 0.0 }
[drift]
x1 = "-0.6*x1 + 1.2*x2"
x2 = "-1.2*x1 - 0.6*x2"
[diffusion]
x1 = ["0.6", "0.1"]
x2 = ["-0.2", "0.5"]
[observation]
kind = "continuous"
h = ["x1", "x2 - 0.3*x1"]
)TOML";

struct Problem {
  Model model;
  ObservationPath path;
  std::size_t steps;
  Problem(Model m, std::size_t n) : model(std::move(m)), steps(n) {
    path = simulate(model, 5.0, 100'000, 2'000, 2026).observations;
  }
  ObservationWindows windows() const { return {path, model.observation, model.timing, steps}; }
};

FilterOptions tree(const Model& model, ThinningMethod method, std::size_t nodes) {
  FilterOptions o;
  o.formula = find_formula(5, static_cast<int>(model.noise_dimension()),
                           WIENERTREE_SOURCE_DIR "/data/cubature_formulas");
  o.thinning.method = method;
  o.nodes = nodes;
  return o;
}

// The relative error of a standard deviation from M launches is (2(M-1))^{-1/2}, and that of the slope
// through four values of N, log N having a standard deviation of 1.23 over them,
// (2(M-1))^{-1/2} / (2 * 1.23): 0.04 for M = 60, 0.08 for M = 15. Seeds are fixed, and results the same on
// every machine: no alarm is by chance.
double slope_of_spread(const Problem& p, std::uint32_t launches, const std::string& label) {
  std::vector<double> N, sd;
  fmt::print("{:<22}", label);
  for (const std::size_t nodes : {300, 900, 2700, 8100}) {
    double sum = 0, squares = 0;
    FilterOptions o = tree(p.model, ThinningMethod::tbba, nodes);
    for (o.launch = 0; o.launch < launches; ++o.launch) {
      const auto filter = make_filter(p.model, o);
      run(*filter, p.windows(), {});
      const double m = mean(filter->posterior(), 0);
      sum += m;
      squares += m * m;
    }
    N.push_back(static_cast<double>(nodes));
    sd.push_back(std::sqrt((squares - sum * sum / launches) / (launches - 1)));
    fmt::print("  N {:>5}: {:.2e}", nodes, sd.back());
  }
  const double slope = log_slope(N, sd);
  fmt::print("  slope {:.2f}\n", slope);
  return slope;
}

struct Errors {
  double mean = 0, covariance = 0;
  double moment[4] = {};
};

// Root mean squares over the components, and over the launches where thinning is random.
Errors errors(const Problem& p, const Posterior& exact, FilterOptions o) {
  const std::uint32_t runs = recombines(o.thinning.method) ? 1 : 8;
  Errors e;
  for (o.launch = 0; o.launch < runs; ++o.launch) {
    const auto filter = make_filter(p.model, o);
    run(*filter, p.windows(), {});
    const Posterior& q = filter->posterior();
    for (std::size_t i = 0; i < 3; ++i) {
      e.mean += std::pow(mean(q, i) - mean(exact, i), 2) / (3 * runs);
      for (std::size_t j = 0; j < 3; ++j)
        e.covariance += std::pow(covariance(q, i, j) - covariance(exact, i, j), 2) / (9 * runs);
    }
    for (int k = 1; k <= 4; ++k)
      e.moment[k - 1] += std::pow(raw_moment(q, 0, k) - raw_moment(exact, 0, k), 2) / runs;
  }
  for (double* x : {&e.mean, &e.covariance, &e.moment[0], &e.moment[1], &e.moment[2], &e.moment[3]})
    *x = std::sqrt(*x);
  return e;
}

}  // namespace

TEST_CASE("spatial TBBA: the spread falls faster than N^{-1/2}, and as N^{-0.9} on the line") {
  CHECK(slope_of_spread(Problem(bundled_model("benes"), 20), 60, "d = 1, Benes") <= -0.9);
  CHECK(slope_of_spread(Problem(parse_model(rotation, "rotation.toml"), 20), 15, "d = 2, rotation") <= -0.6);
  CHECK(slope_of_spread(Problem(bundled_model("linear-3d"), 20), 15, "d = 3, linear-3d") <= -0.6);
}

TEST_CASE("linear-3d against Kalman-Bucy: mean, covariance and moments against N") {
  const Problem p(bundled_model("linear-3d"), 50);
  FilterOptions kalman;
  kalman.method = FilterMethod::kalman_bucy;
  const auto exact = make_filter(p.model, kalman);
  run(*exact, ObservationWindows(p.path, p.model.observation, p.model.timing, 0), {});
  const Posterior& truth = exact->posterior();
  fmt::print("{:<15} {:>6} {:>9} {:>11} {:>9} {:>9} {:>9} {:>9}\n", "thinning", "N", "mean", "covariance",
             "E x1", "E x1^2", "E x1^3", "E x1^4");
  double tbba = 0, recombination = 0;
  const auto row = [&](ThinningMethod method, const char* name, std::size_t N) {
    const Errors e = errors(p, truth, tree(p.model, method, N));
    fmt::print("{:<15} {:>6} {:>9.1e} {:>11.1e} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e}\n", name, N, e.mean,
               e.covariance, e.moment[0], e.moment[1], e.moment[2], e.moment[3]);
    return e.mean;
  };
  for (const std::size_t N : {500, 2000, 8000}) tbba = row(ThinningMethod::tbba, "tbba", N);
  for (const std::size_t N : {500, 2000, 8000}) row(ThinningMethod::systematic, "systematic", N);
  for (const std::size_t N : {150, 300, 600})
    recombination = row(ThinningMethod::recombination, "recombination", N);
  CHECK(recombination < 2e-3);
  CHECK(recombination < tbba);
}
