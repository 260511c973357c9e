/// What the order of the sites does to TBBA (problem C): Benes, mu 0.05, sigma 1, h1 0.8, h2 0, x0 0, T 20,
/// degree 5, second-order. Source of truth: the exact Benes filter on 10 simulated observation paths.
/// Criterion: at N = 10^4 and n = 160 the standard deviation over launches in spatial order is at most a
/// fifth of that in tree order, and the RMSE over the paths in spatial order is below 1.5e-3.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

FilterOptions tbba(SiteOrder order) {
  FilterOptions o;
  o.formula = construct_lyons_victoir_5_1();
  o.thinning = {ThinningMethod::tbba, order, 0};
  o.nodes = 10'000;
  return o;
}

double standard_deviation(const BenesProblem& problem, FilterOptions options, std::size_t n,
                          unsigned launches) {
  double sum = 0, squares = 0;
  for (unsigned l = 0; l < launches; ++l) {
    options.launch = l;
    const double e = problem.error(options, n, 0);
    sum += e;
    squares += e * e;
  }
  return std::sqrt((squares - sum * sum / launches) / (launches - 1));
}

}  // namespace

TEST_CASE("problem C: spatial order takes the noise out of TBBA") {
  const BenesProblem problem("benes", 20.0, 10);
  constexpr std::size_t n = 160;
  // The ratio of two standard deviations of 8 launches each exceeds its true value of about 20 by a factor 4
  // with probability below 1e-3 (F distribution, 7 and 7 degrees of freedom); the seed is fixed.
  const double tree = standard_deviation(problem, tbba(SiteOrder::tree), n, 8);
  const double spatial = standard_deviation(problem, tbba(SiteOrder::spatial), n, 8);
  fmt::print("standard deviation over launches: tree order {:.2e}, spatial order {:.2e}, ratio {:.1f}\n",
             tree, spatial, tree / spatial);
  CHECK(spatial < tree / 5);

  const double rmse = problem.rmse(tbba(SiteOrder::spatial), n);
  fmt::print("RMSE over 10 paths, spatial TBBA, N = 10^4, n = {}: {:.2e}\n", n, rmse);
  CHECK(rmse < 1.5e-3);
}
