/// The annual flow of the Nile, 1871-1970, as a local level (Durbin, Koopman 2012, Time Series Analysis by
/// State Space Methods, section 2.2), from a vague start N(0, 10^7). Source of truth: the Kalman filter,
/// log-likelihood -641.585578, mean 798.36911 and variance 4032.08089 in 1970. Criterion: the exact filter to
/// all digits given; KLV with recombination, degree 7, one step a year, to 1e-3 in log-evidence and 0.05 in
/// the mean, whose standard deviation is 63.5; random methods within their own error: with M launches,
/// |t| < 9 for t = (mean - truth)/(sd/sqrt(M)). Under the null hypothesis t is Student's with M - 1 = 29
/// degrees of freedom, |t| > 9 has probability 7e-10, and there are 2 tests of each of 7 methods.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "papers/discrete_problem.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr double log_likelihood = -641.585578, last_mean = 798.36911, last_variance = 4032.08089;

FilterOptions tree(ThinningMethod thin, std::size_t nodes) {
  FilterOptions o;
  o.formula = bundled_formula(7, 1);
  o.thinning.method = thin;
  o.nodes = nodes;
  return o;
}

void check_random(const DiscreteProblem& nile, FilterOptions o, const std::string& label) {
  constexpr std::uint32_t M = 30;
  constexpr double bound = 9;
  double ratio = 0, ratio2 = 0, m = 0, m2 = 0;
  for (o.launch = 0; o.launch < M; ++o.launch) {
    const auto filter = nile.filtered(o, 1);
    const Posterior& p = filter->posterior();
    const double r = std::exp(p.log_evidence - log_likelihood), x = mean(p, 0);
    ratio += r / M;
    ratio2 += r * r / M;
    m += x / M;
    m2 += x * x / M;
  }
  const double se_ratio = std::sqrt((ratio2 - ratio * ratio) / (M - 1)),
               se = std::sqrt((m2 - m * m) / (M - 1));
  fmt::print("{:<28} evidence ratio {:.4f} +- {:.4f}   mean in 1970 {:.3f} +- {:.3f}\n", label, ratio,
             se_ratio, m, se);
  INFO(label);
  CHECK(std::abs(ratio - 1) < bound * se_ratio);
  // The mean of a normalised estimate is biased by about its own variance over N: far below the error.
  CHECK(std::abs(m - last_mean) < bound * se);
}

}  // namespace

TEST_CASE("Nile: the Kalman filter has the published digits") {
  const DiscreteProblem nile("nile", "nile");
  FilterOptions o;
  for (const FilterMethod method : {FilterMethod::kalman, FilterMethod::grid}) {
    o.method = method;
    const auto filter = nile.filtered(o, 1);
    const Posterior& p = filter->posterior();
    CHECK(p.log_evidence == Approx(log_likelihood).margin(1e-6));
    CHECK(mean(p, 0) == Approx(last_mean).margin(1e-5));
    CHECK(covariance(p, 0, 0) == Approx(last_variance).margin(1e-4));
  }
}

TEST_CASE("Nile: KLV with recombination") {
  const DiscreteProblem nile("nile", "nile");
  for (const std::size_t nodes : {30, 60, 200}) {
    const auto filter = nile.filtered(tree(ThinningMethod::recombination, nodes), 1);
    const Posterior& p = filter->posterior();
    fmt::print("KLV, {} nodes: log-evidence {:+.1e}, mean {:+.1e}, variance {:+.1e}\n", nodes,
               p.log_evidence - log_likelihood, mean(p, 0) - last_mean, covariance(p, 0, 0) - last_variance);
    CHECK(p.log_evidence == Approx(log_likelihood).margin(1e-3));
    CHECK(mean(p, 0) == Approx(last_mean).margin(0.05));
  }
}

TEST_CASE("Nile: every random method agrees within its own error") {
  const DiscreteProblem nile("nile", "nile");
  check_random(nile, tree(ThinningMethod::tbba, 1000), "KLV, tbba");
  check_random(nile, tree(ThinningMethod::multinomial, 1000), "KLV, multinomial");
  FilterOptions o;
  o.method = FilterMethod::euler;
  o.nodes = 5000;
  for (const auto& [thin, name] : {std::pair{ThinningMethod::systematic, "systematic"},
                                   {ThinningMethod::tbba, "tbba"},
                                   {ThinningMethod::multinomial, "multinomial"}}) {
    o.thinning.method = thin;
    check_random(nile, o, fmt::format("Euler, {}", name));
  }
  o.ess_threshold = 0.5;
  check_random(nile, o, "Euler, multinomial, ESS 0.5");
  o.method = FilterMethod::gaussian_mixture;
  o.ess_threshold = 1;
  o.thinning.method = ThinningMethod::tbba;
  check_random(nile, o, "Gaussian mixture, tbba");
}
