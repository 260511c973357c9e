/// Whether the error that `weak --tolerance` tells is at least the error that it has.
///
/// Problems of known value (weak_problems.hpp), each to tolerances 1e-1, 1e-2, .. down to one that depends on
/// the problem. Criterion: |value - exact| <= estimate <= tolerance in every run, where nothing is drawn and
/// the fields are smooth. Beyond Feller's condition in v they are not where the nodes are, no order is seen,
/// and the criterion is three times the estimate. The estimate is several times the error as a rule; the
/// program prints both, and their ratio's median.
///
/// Sampled trees: with the standard error SE of the launches, |value - exact| <= the estimates of what is not
/// drawn + 5.5 SE. H0: the mean over at least 16 launches is normal about a value within these estimates;
/// false alarms below 1e-7 for a normal mean, and for Student's t with 15 degrees of freedom 6e-5: the seed
/// is fixed and the estimates of what is not drawn are far too large, which leaves none in practice.
#include <algorithm>
#include <catch2/catch.hpp>

#include "weak_problems.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

constexpr bool full = WIENERTREE_FULL;

// The last tolerance, by problem in the order of known_averages: in the default set, and in full.
constexpr double finest[][2] = {{1e-9, 1e-9}, {1e-5, 1e-8}, {1e-10, 1e-11}, {1e-9, 1e-9}, {1e-4, 1e-6},
                                {1e-4, 1e-6}, {1e-2, 1e-3}, {1e-3, 1e-6},   {1e-3, 1e-5}};

}  // namespace

TEST_CASE("estimates of the error are not below the error") {
  std::vector<double> ratio;
  fmt::print("problem, tolerance: error, estimate = steps + thinning + ODE + sampling\n");
  const std::vector<KnownAverage> problems = known_averages();
  for (std::size_t i = 0; i < problems.size(); ++i)
    for (double tolerance = 0.1; tolerance > 0.99 * finest[i][full]; tolerance /= 10) {
      const KnownAverage& problem = problems[i];
      INFO(problem.name << " " << tolerance);
      const ControlledResult result = to_tolerance(problem, tolerance);
      print(problem.name, tolerance, result, problem.exact);
      const double error = std::abs(result.value[0] - problem.exact), estimate = result.error[0].total();
      const double factor = problem.name == "Heston beyond Feller, in v" ? 3 : 1;
      CHECK(error <= factor * estimate + problem.known_to);
      CHECK(estimate <= tolerance);
      if (error > problem.known_to) ratio.push_back(estimate / error);
    }
  std::sort(ratio.begin(), ratio.end());
  fmt::print("estimate / error: least {:.2g}, median {:.2g}, most {:.2g}\n", ratio.front(),
             ratio[ratio.size() / 2], ratio.back());
}

TEST_CASE("estimates of sampled trees") {
  for (const KnownAverage& problem : known_averages()) {
    if (problem.name != "Heston, call" && problem.name != "Heston, Asian call") continue;
    for (const double tolerance : {1e-2, 1e-3, 3e-4}) {
      if (!full && tolerance < 1e-3) continue;
      const ControlledResult result = to_tolerance(problem, tolerance, ThinningMethod::tbba);
      print(problem.name + ", TBBA", tolerance, result, problem.exact);
      const WeakErrorSplit& e = result.error[0];
      CHECK(std::abs(result.value[0] - problem.exact) <=
            e.total() - e.sampling + 5.5 * result.standard_error[0] + problem.known_to);
      CHECK(e.sampling == Approx(2 * result.standard_error[0]));
      CHECK(e.thinning == 0);
      CHECK(e.total() <= tolerance);
    }
  }
}
