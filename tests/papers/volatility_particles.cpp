/// Stochastic volatility of the DAX by particles, as in volatility.cpp, with systematic resampling at every
/// day. Source of truth: Euler's chain of an Ornstein-Uhlenbeck process with one step a day is again an
/// autoregression, phi' = 1 - kappa and s' = sigma (of the process), from the same start: its exact
/// log-evidence by the grid filter. Null hypothesis: log Z is N(log Z* - v/2, v), the limit law of an
/// unbiased particle estimate Z whose variance is bounded (Berard, Del Moral, Doucet 2014, A lognormal
/// central limit theorem for particle approximations of normalizing constants, Electron. J. Probab. 19). With
/// mean m and variance s^2 of M launches' log Z, (m + s^2/2 - log Z*) / sqrt(s^2/M + s^4/(2(M - 1))) is about
/// Student's with M - 1 = 11 degrees of freedom: beyond 10 with probability 7e-7.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/discrete_problem.hpp"

using namespace wienertree;
using namespace wienertree::papers;

TEST_CASE(
    "DAX: Euler particles agree with the exact evidence of their chain within their Monte-Carlo error") {
  constexpr std::uint32_t M = 12;
  for (const VolatilityCase& c : volatility_cases) {
    DiscreteProblem dax = DiscreteProblem::dax(c);
    const double kappa = -std::log(c.phi), sigma = c.s * std::sqrt(2 * kappa / (1 - c.phi * c.phi));
    DiscreteProblem chain = DiscreteProblem::dax({1 - kappa, sigma, c.beta, 0});
    chain.model.initial_law = dax.model.initial_law;
    FilterOptions o;
    o.method = FilterMethod::grid;
    const double truth = chain.log_evidence(o, 1);
    o.method = FilterMethod::euler;
    o.thinning.method = ThinningMethod::systematic;
    o.nodes = 20'000;
    double sum = 0, squares = 0;
    for (o.launch = 0; o.launch < M; ++o.launch) {
      const double l = dax.log_evidence(o, 1) - truth;
      sum += l;
      squares += l * l;
    }
    const double m = sum / M, v = (squares - sum * m) / (M - 1);
    const double t = (m + v / 2) / std::sqrt(v / M + v * v / (2 * (M - 1)));
    fmt::print(
        "phi {}: process {:.4f}, Euler's chain {:.4f}; {} launches of {} particles: {:+.3f} from it, sd "
        "{:.3f}, t {:.2f}\n",
        c.phi, c.log_evidence, truth, M, o.nodes, m, std::sqrt(v), t);
    CHECK(std::abs(t) < 10);
    CHECK(v < 4);
  }
}
