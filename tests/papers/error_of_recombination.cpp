/// Problem C by recombination: Benes, mu 0.05, sigma 1, h1 0.8, h2 0, x0 0, T 20, degree 5, second-order.
/// Source of truth: the exact Benes filter on 10 simulated observation paths.
/// Criterion: RMSE of the posterior mean at T over the paths at most 8e-3 (n = 40), 1.6e-3 (n = 80) and 2e-4
/// (n = 320) with at most 60 nodes kept; fitted slope of log RMSE against log n over n = 40 .. 320 at most
/// -1.8; two runs give the same bytes. The error is that of the steps, not of thinning: 20 nodes give what 60
/// do.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

FilterOptions recombination(std::size_t nodes, CubatureFormula formula = construct_lyons_victoir_5_1()) {
  FilterOptions o;
  o.formula = std::move(formula);
  o.thinning.method = ThinningMethod::recombination;
  o.nodes = nodes;
  return o;
}

const BenesProblem& problem_c() {
  static const BenesProblem problem("benes", 20.0, 10);
  return problem;
}

// The bytes of all that a run's posteriors hold, and the most nodes it kept.
struct Trace {
  std::vector<double> numbers;
  std::size_t kept = 0;
};

Trace trace(const BenesProblem& problem, const FilterOptions& options, std::size_t n) {
  Trace out;
  const auto filter = make_filter(problem.model, options);
  run(*filter, ObservationWindows(problem.paths[0], problem.model.observation, problem.model.timing, n),
      [&](const Posterior& p) {
        const auto x = p.points.component(0);
        out.numbers.push_back(p.log_evidence);
        out.numbers.insert(out.numbers.end(), x.begin(), x.end());
        out.numbers.insert(out.numbers.end(), p.weight.begin(), p.weight.end());
        out.kept = std::max(out.kept, p.kept);
      });
  return out;
}

}  // namespace

TEST_CASE("problem C by recombination: the error falls as 1/n^2 and is below the targets") {
  const BenesProblem& problem = problem_c();
  fmt::print("{:>6} {:>6} {:>10}\n", "n", "N", "RMSE");
  const auto rmse = [&](std::size_t n, std::size_t N) {
    const double e = problem.rmse(recombination(N), n);
    fmt::print("{:>6} {:>6} {:>10.2e}\n", n, N, e);
    return e;
  };
  const double at_40 = rmse(40, 20), at_80 = rmse(80, 30), at_160 = rmse(160, 40), at_320 = rmse(320, 60);
  CHECK(at_40 <= 8e-3);
  CHECK(at_80 <= 1.6e-3);
  CHECK(at_320 <= 2e-4);
  const double slope = log_slope({40, 80, 160, 320}, {at_40, at_80, at_160, at_320});
  fmt::print("slope {:.2f}\n", slope);
  CHECK(slope <= -1.8);

  const double fewer = rmse(320, 20);
  CHECK(std::abs(fewer - at_320) < 0.1 * at_320);

  const Trace first = trace(problem, recombination(60), 320), second = trace(problem, recombination(60), 320);
  CHECK(first.kept <= 60);
  REQUIRE(first.numbers.size() == second.numbers.size());
  CHECK(std::memcmp(first.numbers.data(), second.numbers.data(), first.numbers.size() * sizeof(double)) == 0);
}

// The functional is exact to O(s^4) a step here (h linear, constant noise): formulas of higher degree show
// their own order until they meet it. Criterion: slope over n = 20 .. 80 at most -2.7 for degree 7, -3.6 for
// degree 11.
TEST_CASE("problem C by recombination: higher degrees converge faster") {
  const BenesProblem& problem = problem_c();
  const std::vector<double> steps{20, 40, 80};
  for (const auto& [degree, slope] : {std::pair{7, -2.7}, {11, -3.6}}) {
    const CubatureFormula formula = find_formula(degree, 1, WIENERTREE_SOURCE_DIR "/data/cubature_formulas");
    std::vector<double> errors;
    fmt::print("degree {:>2}:", degree);
    for (const double n : steps) {
      errors.push_back(problem.rmse(recombination(30, formula), static_cast<std::size_t>(n)));
      fmt::print("  n {} {:.2e}", n, errors.back());
    }
    fmt::print("  slope {:.2f}\n", log_slope(steps, errors));
    CHECK(log_slope(steps, errors) <= slope);
  }
}
