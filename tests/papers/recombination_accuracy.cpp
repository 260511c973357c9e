/// Problem C by recombination: Benes, mu 0.05, sigma 1, h1 0.8, h2 0, x0 0, T 20, degree 5, second-order, at
/// most 60 nodes kept. Source of truth: the exact Benes filter on 10 simulated observation paths. Criteria:
/// RMSE of the mean at T at most 8e-3, 1.6e-3 and 2e-4 for n = 40, 80 and 320 steps; slope of log RMSE
/// against log n at most -1.8; the same bytes twice.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

FilterOptions recombined(std::size_t nodes) {
  FilterOptions o;
  o.formula = construct_lyons_victoir_5_1();
  o.thinning = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  o.nodes = nodes;
  return o;
}

}  // namespace

TEST_CASE("problem C: recombination to at most 60 nodes") {
  const BenesProblem problem("benes", 20.0, 10);
  const std::vector<std::size_t> steps = {40, 80, 160, 320}, nodes = {8, 15, 30, 60};
  const std::vector<double> most = {8e-3, 1.6e-3, INFINITY, 2e-4};
  fmt::print("| n |");
  for (const std::size_t N : nodes) fmt::print(" N = {} |", N);
  fmt::print("\n|---|---|---|---|---|\n");
  std::vector<double> x, best;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    fmt::print("| {} |", steps[i]);
    double rmse = INFINITY;
    for (const std::size_t N : nodes) {
      rmse = problem.rmse(recombined(N), steps[i]);
      fmt::print(" {:.2e} |", rmse);
    }
    fmt::print("\n");
    CHECK(rmse <= most[i]);
    x.push_back(static_cast<double>(steps[i]));
    best.push_back(rmse);
  }
  const double slope = log_slope(x, best);
  fmt::print("slope in n, 60 nodes: {:.3f}\n", slope);
  CHECK(slope <= -1.8);

  const double once = problem.error(recombined(60), 80, 3), again = problem.error(recombined(60), 80, 3);
  CHECK(std::memcmp(&once, &again, sizeof once) == 0);
}
