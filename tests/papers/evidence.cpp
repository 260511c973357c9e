/// The evidence is right and unbiased, for every method, thinning and threshold of the effective sample size.
///
/// An estimate Z of the evidence from particles is unbiased whatever the schedule of resampling (Del Moral
/// 2004, Feynman-Kac Formulae, proposition 7.4.1): E[Z / Z*] = 1, with Z* the evidence of the scheme the
/// particles sample from. Source of truth for Z*: the Euler chain's by quadrature (chain_evidence.hpp), the
/// tree's by recombination with so many nodes that more change nothing. Z* in its turn is compared with the
/// exact Kalman, Kalman-Bucy and Benes filters, from which it differs by the error of the step.
///
/// Null hypothesis of each row: E[Z/Z*] = 1. The statistic t = (mean - 1)/(sd/sqrt(M)) of M launches is taken
/// to be Student's with M - 1 degrees of freedom: |t| > 7.5 has probability below 3e-11 for M = 100 and 2e-13
/// for M = 1000, and there are fewer than 300 rows; the false-alarm rate is below 1e-8. Problems are short
/// enough for Z/Z* to have a standard deviation below 1, so that the mean is near its Gaussian limit.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <functional>

#include "papers/benes_problem.hpp"
#include "papers/chain_evidence.hpp"
#include "papers/discrete_problem.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr std::uint32_t launches = WIENERTREE_LAUNCHES;
constexpr double bound = 7.5;

struct Problem {
  std::string name;
  Model model;
  ObservationPath path;
  std::size_t steps;
  FilterMethod exact;
  double low, high;   ///< where the chain's mass is
  double step_error;  ///< allowed |log Z* - log evidence|: that of the step
  std::size_t nodes;  ///< N
  ObservationWindows windows() const { return {path, model.observation, model.timing, steps}; }
};

ObservationPath first_rows(const ObservationPath& path, std::size_t rows) {
  ObservationPath out;
  out.dimension = path.dimension;
  for (std::size_t r = 0; r < rows; ++r) out.append(path.times[r], path.row(r));
  return out;
}

Model discrete_ornstein_uhlenbeck() {
  return parse_model(R"TOML(
name = "ou"
convention = "ito"
[state]
x = { initial = 0.3 }
[drift]
x = "0.5*(0.4 - x)"
[diffusion]
x = ["0.7"]
[observation]
kind = "discrete"
h = ["x"]
noise = { law = "gaussian", sd = 0.6 }
[initial]
mean = [0.3]
covariance = [[0.25]]
[exact]
filter = "kalman"
)TOML",
                     "ou.toml");
}

// Missing rows and irregular times included.
Problem discrete_linear() {
  Model model = discrete_ornstein_uhlenbeck();
  ObservationPath path = simulate(model, 8, 8000, 16, 5).observations;
  path.values[3] = path.values[9] = path.values[10] = NAN;
  path.times[5] += 0.2;
  return {"linear, discrete", model, path, 32, FilterMethod::kalman, -6, 6, 0.05, 60};
}

Problem continuous_linear() {
  Model model = bundled_model("ornstein-uhlenbeck");
  const ObservationPath path = simulate(model, 4, 40'000, 400, 6).observations;
  return {"linear, continuous", model, path, 40, FilterMethod::kalman_bucy, -6, 6, 0.05, 60};
}

Problem benes() {
  Model model = bundled_model("benes-mixture");
  const ObservationPath path = simulate(model, 4, 40'000, 400, 7).observations;
  return {"Benes", model, path, 40, FilterMethod::benes, -20, 20, 0.1, 60};
}

Problem nile(std::size_t rows) {
  DiscreteProblem p("nile", "nile");
  // As the prior after one vague year: a start from N(0, 10^7) has all its weight on one particle in a
  // hundred.
  p.model.initial_law =
      InitialLaw{Eigen::VectorXd::Constant(1, 1100.0), Eigen::MatrixXd::Constant(1, 1, 4e4)};
  return {"Nile", p.model, first_rows(p.path, rows), rows - 1, FilterMethod::kalman, -600, 2800, 0.01, 200};
}

double log_evidence(const Problem& p, const FilterOptions& options) {
  const auto filter = make_filter(p.model, options);
  run(*filter, p.windows(), {});
  return filter->posterior().log_evidence;
}

double exact(const Problem& p) {
  FilterOptions o;
  o.method = p.exact;
  const auto filter = make_filter(p.model, o);
  run(*filter, ObservationWindows(p.path, p.model.observation, p.model.timing, 0), {});
  return filter->posterior().log_evidence;
}

void check_unbiased(const Problem& p, FilterOptions o, double truth, const std::string& label) {
  double sum = 0, squares = 0;
  for (o.launch = 0; o.launch < launches; ++o.launch) {
    const double ratio = std::exp(log_evidence(p, o) - truth);
    sum += ratio;
    squares += ratio * ratio;
  }
  const double m = sum / launches, sd = std::sqrt((squares - sum * m) / (launches - 1));
  const double t = (m - 1) / (sd / std::sqrt(launches));
  fmt::print("  {:<62} mean {:.4f}  sd {:.4f}  t {:>6.2f}\n", label, m, sd, t);
  INFO(p.name << ", " << label);
  CHECK(sd < 3);
  CHECK(std::abs(t) < bound);
}

FilterOptions tree(const CubatureFormula& formula, ThinningMethod thin, std::size_t nodes) {
  FilterOptions o;
  o.formula = formula;
  o.thinning.method = thin;
  o.nodes = nodes;
  return o;
}

struct NamedThinning {
  ThinningMethod method;
  const char* name;
};
constexpr NamedThinning thinnings[] = {{ThinningMethod::tbba, "tbba"},
                                       {ThinningMethod::multinomial, "multinomial"},
                                       {ThinningMethod::residual, "residual"},
                                       {ThinningMethod::stratified, "stratified"},
                                       {ThinningMethod::systematic, "systematic"}};

constexpr NamedThinning never[] = {{ThinningMethod::none, "none"}};

void check_tree(const Problem& p) {
  const CubatureFormula formula = bundled_formula(5, 1);
  const double truth = log_evidence(p, tree(formula, ThinningMethod::recombination, 400));
  const double coarser = log_evidence(p, tree(formula, ThinningMethod::recombination, 200));
  fmt::print("{}: exact {:.6f}, the tree's {:.6f} (400 nodes; 200: {:+.1e})\n", p.name, exact(p), truth,
             coarser - truth);
  // Far below the standard error of any row.
  CHECK(std::abs(coarser - truth) < 1e-5);
  CHECK(std::abs(truth - exact(p)) < p.step_error);
  for (const auto& [method, name] : thinnings)
    for (const SiteOrder order : {SiteOrder::tree, SiteOrder::spatial}) {
      FilterOptions o = tree(formula, method, p.nodes);
      o.thinning.order = order;
      check_unbiased(p, o, truth,
                     fmt::format("klv, {}, {} order", name, order == SiteOrder::tree ? "tree" : "spatial"));
    }
}

// One method that counts in tree order and one in spatial order, at every threshold below 1.
void check_tree_thresholds(const Problem& p) {
  const CubatureFormula formula = bundled_formula(5, 1);
  const double truth = log_evidence(p, tree(formula, ThinningMethod::recombination, 400));
  fmt::print("{}: the tree's {:.6f}\n", p.name, truth);
  for (const double threshold : {0.7, 0.3})
    for (const SiteOrder order : {SiteOrder::tree, SiteOrder::spatial}) {
      FilterOptions o = tree(formula, ThinningMethod::tbba, p.nodes);
      o.thinning.order = order;
      o.ess_threshold = threshold;
      check_unbiased(p, o, truth,
                     fmt::format("klv, tbba, {} order, likelihoods decide at ESS <= {}",
                                 order == SiteOrder::tree ? "tree" : "spatial", threshold));
    }
}

// Likelihoods that are only carried, or particles never resampled, degenerate: a short record.
void check_tree_carrying(const Problem& p) {
  const CubatureFormula formula = bundled_formula(5, 1);
  const double truth = log_evidence(p, tree(formula, ThinningMethod::recombination, 400));
  for (const auto& [method, name] : thinnings) {
    FilterOptions o = tree(formula, method, p.nodes);
    o.prune_weights = PruneWeights::cubature;
    check_unbiased(p, o, truth, fmt::format("klv, {}, cubature weights prune", name));
  }
}

FilterOptions particles(FilterMethod method, FunctionalMethod functional, std::size_t nodes) {
  FilterOptions o;
  o.method = method;
  o.functional = functional;
  o.nodes = nodes;
  return o;
}

constexpr const char* functional_names[] = {"picard", "trapezoid", "second-order"};

void check_euler(const Problem& p, std::span<const NamedThinning> methods, std::vector<double> thresholds) {
  std::vector<FunctionalMethod> functionals = {FunctionalMethod::picard};
  if (p.model.observation == ObservationKind::continuous)
    functionals.push_back(FunctionalMethod::second_order);
  for (const FunctionalMethod functional : functionals) {
    const double truth = ChainEvidence(p.model, functional, p.low, p.high).log_evidence(p.windows());
    fmt::print("{}: exact {:.6f}, the Euler chain's with {} {:.6f}\n", p.name, exact(p),
               functional_names[static_cast<int>(functional)], truth);
    for (const auto& [method, name] : methods)
      for (const double threshold : thresholds) {
        FilterOptions o = particles(FilterMethod::euler, functional, p.nodes);
        o.thinning.method = method;
        o.ess_threshold = threshold;
        check_unbiased(p, o, truth, fmt::format("euler, {}, resampled at ESS <= {} N", name, threshold));
      }
  }
}

void check_mixture(const Problem& p, FunctionalMethod functional, const std::vector<double>& alphas) {
  const double truth = ChainEvidence(p.model, functional, p.low, p.high).log_evidence(p.windows());
  fmt::print("{}: exact {:.6f}, the Euler chain's with {} {:.6f}\n", p.name, exact(p),
             functional_names[static_cast<int>(functional)], truth);
  for (const ThinningMethod method : {ThinningMethod::tbba, ThinningMethod::multinomial})
    for (const double alpha : alphas) {
      FilterOptions o = particles(FilterMethod::gaussian_mixture, functional, p.nodes);
      o.thinning.method = method;
      o.alpha = alpha;
      check_unbiased(p, o, truth,
                     fmt::format("gaussian-mixture, {}, alpha {}",
                                 method == ThinningMethod::tbba ? "tbba" : "multinomial", alpha));
    }
}

}  // namespace

TEST_CASE("the oracle: Euler's chain of a Brownian signal is exact") {
  // The Nile's level is a Brownian motion, whose Euler chain has its law: quadrature and Kalman agree.
  const Problem p = nile(100);
  CHECK(ChainEvidence(p.model, FunctionalMethod::picard, p.low, p.high).log_evidence(p.windows()) ==
        Approx(exact(p)).margin(1e-9));
}

TEST_CASE("klv: evidence is unbiased for the tree's, and that is right to the step's error") {
  for (const Problem& p : {discrete_linear(), continuous_linear(), benes(), nile(30)}) check_tree(p);
}

TEST_CASE("klv: evidence is unbiased for every threshold of the effective sample size") {
  for (const Problem& p : {discrete_linear(), continuous_linear(), benes()}) check_tree_thresholds(p);
}

TEST_CASE("klv: evidence is unbiased where likelihoods are only carried") {
  Problem p = benes();
  p.path = first_rows(p.path, 101);
  p.steps = 10;
  for (const Problem& q : {p, nile(4)}) check_tree_carrying(q);
}

TEST_CASE("euler: evidence is unbiased for every thinning and every threshold of the effective sample size") {
  for (const Problem& p : {discrete_linear(), continuous_linear(), benes(), nile(30)})
    check_euler(p, thinnings, {1.0, 0.5, 0.2});
}

TEST_CASE("euler: evidence is unbiased without resampling") {
  Problem p = benes();
  p.path = first_rows(p.path, 101);
  p.steps = 10;
  for (const Problem& q : {p, nile(4)}) check_euler(q, never, {1.0});
}

TEST_CASE("gaussian-mixture: evidence is unbiased for the Euler chain's") {
  for (const Problem& p : {discrete_linear(), continuous_linear(), benes(), nile(30)})
    check_mixture(p, FunctionalMethod::picard, {0.0, 0.13, 0.5});
  // The end of a step is weighed at the Gaussian's mean: a bias of order alpha s, not seen at
  // alpha = N^{-1/2} = 0.13.
  for (const Problem& p : {continuous_linear(), benes()})
    check_mixture(p, FunctionalMethod::second_order, {0.0, 0.13});
}
