/// Error against the number of steps (problem B): Benes, mu 0.5, sigma 0.8, h1 0.4, h2 0, x0 1, T 10,
/// phi(x) = x. Source of truth: the exact Benes filter on 12 simulated observation paths. Published: Crisan,
/// Ortiz-Latorre (2013) find slope -1 for Picard's functional. Ours: -1 for `picard`, -2 for `second-order`.
/// Criterion: fitted slope in [-1.2, -0.8] for picard, at most -1.8 for second-order, degree 5.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

FilterOptions options_with(FunctionalMethod functional, const CubatureFormula& formula) {
  FilterOptions o;
  o.formula = formula;
  o.functional = functional;
  // Recombination with this many nodes leaves an error of thinning below 1e-5 here (see the last row of the
  // table).
  o.thinning.method = ThinningMethod::recombination;
  o.nodes = 200;
  return o;
}

double fitted_slope(const BenesProblem& problem, const FilterOptions& options,
                    const std::vector<double>& steps, const std::string& label) {
  std::vector<double> errors;
  fmt::print("{:>24}", label);
  for (const double n : steps) {
    errors.push_back(problem.rmse(options, static_cast<std::size_t>(n)));
    fmt::print("  n {:>4}: {:.2e}", n, errors.back());
  }
  const double slope = log_slope(steps, errors);
  fmt::print("  slope {:.2f}\n", slope);
  return slope;
}

}  // namespace

TEST_CASE("problem B: the error falls as 1/n with picard and as 1/n^2 with second-order") {
  const BenesProblem problem("benes-convergence", 10.0, 12);
  const CubatureFormula degree_3 = construct_degree_3(1), degree_5 = construct_lyons_victoir_5_1();

  const double picard = fitted_slope(problem, options_with(FunctionalMethod::picard, degree_5),
                                     {80, 160, 320, 625, 1250}, "picard, degree 5");
  CHECK(picard > -1.2);
  CHECK(picard < -0.8);
  const auto second = options_with(FunctionalMethod::second_order, degree_5);
  CHECK(fitted_slope(problem, second, {10, 20, 40, 80}, "second-order, degree 5") < -1.8);
  fitted_slope(problem, options_with(FunctionalMethod::trapezoid, degree_5), {80, 160, 320, 625},
               "trapezoid, degree 5");
  fitted_slope(problem, options_with(FunctionalMethod::second_order, degree_3), {20, 40, 80, 160},
               "second-order, degree 3");

  auto finer = second;
  finer.nodes = 400;
  const double change = std::abs(problem.rmse(finer, 80) - problem.rmse(second, 80));
  fmt::print("doubling the nodes at n = 80 changes the RMSE by {:.1e}\n", change);
  CHECK(change < 0.05 * problem.rmse(second, 80));
}
