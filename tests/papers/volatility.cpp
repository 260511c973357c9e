/// Stochastic volatility of the DAX, 1991-1998 (1859 daily returns): y_t ~ N(0, beta^2 exp(x_t)),
/// x_t = phi x_{t-1} + N(0, s^2), stationary start
/// (Taylor 1986; Kim, Shephard, Chib 1998, Rev. Econ. Stud. 65, 361-393).
/// Source of truth: log-likelihoods by quadrature on a grid, -2511.197502 at (phi, s, beta) = (0.97, 0.2,
/// 0.9) and -2520.781821 at (0.95, 0.3, 0.7), to 6 decimals. Criterion: the grid filter to 1e-5; the KLV
/// filter of degree 7 with recombination to at most 200 nodes, one step a day, to 0.05, and so for the log
/// Bayes factor.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/discrete_problem.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

FilterOptions recombination(int degree, std::size_t nodes) {
  FilterOptions o;
  o.formula = bundled_formula(degree, 1);
  o.thinning.method = ThinningMethod::recombination;
  o.nodes = nodes;
  return o;
}

}  // namespace

TEST_CASE("DAX: the grid filter has the log-likelihood of quadrature to 1e-5") {
  for (const VolatilityCase& c : volatility_cases) {
    FilterOptions grid;
    grid.method = FilterMethod::grid;
    const double value = DiscreteProblem::dax(c).log_evidence(grid, 1);
    fmt::print("grid, phi {}, s {}, beta {}: {:.6f}\n", c.phi, c.s, c.beta, value);
    CHECK(value == Approx(c.log_evidence).margin(1e-5));
  }
}

TEST_CASE("DAX: KLV with recombination has the log-evidence and the Bayes factor to 0.05") {
  const DiscreteProblem first = DiscreteProblem::dax(volatility_cases[0]),
                        second = DiscreteProblem::dax(volatility_cases[1]);
  const double factor = volatility_cases[0].log_evidence - volatility_cases[1].log_evidence;
  fmt::print("{:>6} {:>6} {:>10} {:>12} {:>12} {:>12}\n", "degree", "nodes", "steps/day", "error 1",
             "error 2", "error of log B");
  struct Run {
    int degree;
    std::size_t nodes, steps_a_day;
    bool asserted;
  };
  for (const Run& r : {Run{5, 60, 1, false}, Run{5, 60, 2, false}, Run{7, 10, 1, false}, Run{7, 20, 1, true},
                       Run{7, 60, 1, true}, Run{7, 200, 1, true}, Run{9, 60, 1, true}}) {
    const FilterOptions o = recombination(r.degree, r.nodes);
    const double one = first.log_evidence(o, r.steps_a_day), two = second.log_evidence(o, r.steps_a_day);
    const double e1 = one - volatility_cases[0].log_evidence, e2 = two - volatility_cases[1].log_evidence;
    fmt::print("{:>6} {:>6} {:>10} {:>12.6f} {:>12.6f} {:>12.6f}\n", r.degree, r.nodes, r.steps_a_day, e1, e2,
               one - two - factor);
    if (!r.asserted) continue;
    CHECK(std::abs(e1) < 0.05);
    CHECK(std::abs(e2) < 0.05);
    CHECK(std::abs(one - two - factor) < 0.05);
  }
}
