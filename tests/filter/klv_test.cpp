#include "wienertree/filter/klv_filter.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "filter/text_problems.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/benes_filter.hpp"

using namespace wienertree;

namespace {

constexpr const char* two_dimensional = R"TOML(
name = "two"
convention = "stratonovich"
[state]
x = { initial = 0.3 }
z = { initial = -0.2 }
[drift]
x = "-0.7*x"
z = "0.4 - 0.2*z"
[diffusion]
x = ["0.6", "0"]
z = ["0.1", "0.5"]
[observation]
kind = "continuous"
h = ["x*z", "sin(x)"]
)TOML";

// The same model again, by hand: the flow of dx = -0.7 x D0 + 0.6 D1, dz = (0.4 - 0.2 z) D0 + 0.1 D1 + 0.5 D2
// in closed form.
struct Point {
  double x, z;
};
Point flow(Point a, const Eigen::VectorXd& D) {
  const auto linear = [](double y, double rate, double constant) {
    const double growth = rate == 0 ? 1.0 : std::expm1(rate) / rate;  // int_0^1 exp(rate (1-u)) du
    return y * std::exp(rate) + constant * growth;
  };
  return {linear(a.x, -0.7 * D(0), 0.6 * D(1)),
          linear(a.z, -0.2 * D(0), 0.4 * D(0) + 0.1 * D(1) + 0.5 * D(2))};
}
std::array<double, 2> h(Point a) { return {a.x * a.z, std::sin(a.x)}; }

// log w of the three functionals for this model, written from their formulas.
double log_weight(FunctionalMethod method, const ObservationWindow& w, Point a, Point b) {
  const auto h0 = h(a), h1 = h(b);
  const double s = w.length();
  double quadratic = 0, picard = 0, trapezoid = 0, second = 0, norm = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    quadratic += s / 6 * (h0[i] * h0[i] + h0[i] * h1[i] + h1[i] * h1[i]);
    picard += h0[i] * w.increment[i] - s / 2 * h0[i] * h0[i];
    trapezoid += (h0[i] + h1[i]) / 2 * w.increment[i];
    second += h0[i] * w.increment[i] + (h1[i] - h0[i]) * w.integral[i] / s;
  }
  // G_ir = V_r h_i: V_1 = (0.6, 0.1), V_2 = (0, 0.5); h_1 = x z, h_2 = sin x.
  const double G[2][2] = {{0.6 * a.z + 0.1 * a.x, 0.5 * a.x}, {0.6 * std::cos(a.x), 0}};
  double trace = 0;
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t l = 0; l < 2; ++l) {
      const double M = w.covariation[i * 2 + l] - (i == l ? s * s / 6 : 0) - w.bridge_start[i] * h0[l] -
                       w.bridge_end[i] * h1[l] - w.bridge_start[l] * h0[i] - w.bridge_end[l] * h1[i] +
                       s * s * s / 45 * (h0[i] * h0[l] + h1[i] * h1[l]) +
                       7 * s * s * s / 360 * (h0[i] * h1[l] + h1[i] * h0[l]);
      for (std::size_t r = 0; r < 2; ++r) trace += G[i][r] * G[l][r] * M / 2;
      norm += G[i][l] * G[i][l];
    }
  trace /= 1 + s * s * norm / (std::numbers::pi * std::numbers::pi);
  if (method == FunctionalMethod::picard) return picard;
  if (method == FunctionalMethod::trapezoid) return trapezoid - quadratic;
  return second - quadratic + trace;
}

struct BruteForce {
  double mass = 0, mx = 0, mz2 = 0;
};

// rho^n(phi) as the sum over all words b of paths, recursively, in the definition's order.
void sum_words(const CubatureFormula& formula, const std::vector<ObservationWindow>& windows,
               FunctionalMethod method, std::size_t level, Point at, double weight, BruteForce& out) {
  if (level == windows.size()) {
    out.mass += weight;
    out.mx += weight * at.x;
    out.mz2 += weight * at.z * at.z;
    return;
  }
  for (const CubaturePath& path : formula.paths) {
    Point b = at;
    Eigen::VectorXd D(3);
    for (Eigen::Index segment = 0; segment < path.increments.cols(); ++segment) {
      scaled_increments(path, static_cast<std::size_t>(segment), windows[level].length(), {D.data(), 3});
      b = flow(b, D);
    }
    sum_words(formula, windows, method, level + 1, b,
              weight * path.weight * std::exp(log_weight(method, windows[level], at, b)), out);
  }
}

FilterOptions tbba(const CubatureFormula& formula, std::size_t N) {
  FilterOptions o;
  o.formula = formula;
  o.nodes = N;
  o.thinning.method = ThinningMethod::tbba;
  return o;
}

}  // namespace

TEST_CASE("the full tree is its definition, for every functional and both prune weights") {
  const Model model = parse_model(two_dimensional, "two.toml", {});
  const CubatureFormula formula = construct_degree_3(2);
  const auto path = simulate(model, 1.5, 600, 60, 3).observations;
  for (const std::size_t n : {1, 2, 4})
    for (const auto method :
         {FunctionalMethod::picard, FunctionalMethod::trapezoid, FunctionalMethod::second_order})
      for (const auto prune : {PruneWeights::cubature, PruneWeights::likelihood}) {
        FilterOptions o = tbba(formula, 1);
        o.method = FilterMethod::full_tree;
        o.functional = method;
        o.prune_weights = prune;
        const ObservationWindows windows(path, model.observation, model.timing, n);
        const auto filter = make_filter(model, o);
        run(*filter, windows, {});
        const Posterior& p = filter->posterior();
        std::vector<ObservationWindow> all(n);
        for (std::size_t j = 0; j < n; ++j) windows.get(j, all[j]);
        BruteForce b;
        sum_words(formula, all, method, 0, {0.3, -0.2}, 1.0, b);
        CHECK(p.size() == static_cast<std::size_t>(std::pow(4, n)));
        CHECK(p.log_evidence == Approx(std::log(b.mass)).epsilon(1e-12).margin(1e-12));
        CHECK(mean(p, 0) == Approx(b.mx / b.mass).epsilon(1e-12).margin(1e-13));
        CHECK(raw_moment(p, 1, 2) == Approx(b.mz2 / b.mass).epsilon(1e-12));
      }
}

TEST_CASE("a tree whose children fit in N is not thinned") {
  const Model model = benes_cases[1].model();
  const auto path = simulate(model, 1, 100, 100, 3).observations;
  FilterOptions full = tbba(construct_degree_3(1), 64), thinned = full;
  full.method = FilterMethod::full_tree;
  const ObservationWindows windows(path, model.observation, model.timing, 6);
  const auto a = make_filter(model, full), b = make_filter(model, thinned);
  run(*a, windows, {});
  run(*b, windows, {});
  CHECK(a->posterior().log_evidence == b->posterior().log_evidence);
  CHECK(mean(a->posterior(), 0) == mean(b->posterior(), 0));
}

TEST_CASE("random thinning leaves the full tree's evidence as its expectation, whenever likelihoods decide") {
  const Model model = benes_cases[3].model();
  const auto path = simulate(model, 4, 400, 400, 5).observations;
  const ObservationWindows windows(path, model.observation, model.timing, 8);
  FilterOptions full = tbba(construct_lyons_victoir_5_1(), 1);
  full.method = FilterMethod::full_tree;
  const auto tree = make_filter(model, full);
  run(*tree, windows, {});
  const auto check = [&](ThinningMethod thinning, PruneWeights prune, double threshold) {
    double sum = 0, squares = 0;
    constexpr std::uint32_t launches = 400;
    for (std::uint32_t l = 0; l < launches; ++l) {
      FilterOptions o = tbba(construct_lyons_victoir_5_1(), 30);
      o.thinning.method = thinning;
      o.prune_weights = prune;
      o.ess_threshold = threshold;
      o.launch = l;
      const auto filter = make_filter(model, o);
      run(*filter, windows, {});
      const double ratio = std::exp(filter->posterior().log_evidence - tree->posterior().log_evidence);
      sum += ratio / launches;
      squares += ratio * ratio / launches;
    }
    const double se = std::sqrt((squares - sum * sum) / (launches - 1));
    INFO("threshold " << threshold << ": ratio of evidences " << sum << " +- " << se);
    // Null hypothesis: expectation 1. |t| > 6.5 on 399 degrees of freedom: 2e-10.
    CHECK(std::abs(sum - 1) < 6.5 * se);
    CHECK(se < 0.02);
  };
  for (const ThinningMethod thinning : {ThinningMethod::tbba, ThinningMethod::systematic}) {
    for (const double threshold : {1.0, 0.9, 0.5}) check(thinning, PruneWeights::likelihood, threshold);
    check(thinning, PruneWeights::cubature, 1.0);
  }
}

TEST_CASE("a node that fails and is dropped takes its mass with it") {
  // One step of length 1 from 0.4 ends at 0.4 and 0.4 +- 0.3 sqrt(3): the lowest is outside.
  const Model model = parse_model(R"TOML(
name = "bounded"
convention = "ito"
[state]
x = { initial = 0.4, lower = 0.0 }
[drift]
x = 0
[diffusion]
x = [0.3]
[observation]
kind = "discrete"
h = ["x"]
noise = { law = "gaussian", sd = 0.5 }
)TOML",
                                  "bounded.toml", {});
  ObservationPath path;
  path.dimension = 1;
  path.append(0, std::vector<double>{NAN});
  path.append(1, std::vector{0.7});
  FilterOptions o = tbba(construct_lyons_victoir_5_1(), 10);
  o.on_node_failure = OnNodeFailure::drop;
  const auto filter = make_filter(model, o);
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  const auto density = [](double x) {
    return std::exp(-std::pow((0.7 - x) / 0.5, 2) / 2) / (0.5 * std::sqrt(2 * std::numbers::pi));
  };
  const double middle = 2.0 / 3 * density(0.4), upper = 1.0 / 6 * density(0.4 + 0.3 * std::sqrt(3.0));
  const Posterior& p = filter->posterior();
  CHECK(filter->statistics().dropped_nodes == 1);
  CHECK(p.log_evidence == Approx(std::log(middle + upper)).epsilon(1e-12));
  CHECK(mean(p, 0) == Approx(0.4 + 0.3 * std::sqrt(3.0) * upper / (middle + upper)).epsilon(1e-12));
}

TEST_CASE("log-evidence agrees with the closed form on all four Benes problems") {
  for (const BenesCase& c : benes_cases) {
    const Model model = c.model();
    const auto path = simulate(model, c.horizon, 100'000, 10'000, 12).observations;
    BenesFilter exact(model);
    run(exact, ObservationWindows(path, model.observation, model.timing, 0), {});
    // Discretisation error O(n^-2): the difference between n and n/2 steps is 3 times the error at n; twice
    // that is allowed, plus 4 standard deviations of the launches for thinning.
    double value[2] = {}, square = 0;
    constexpr unsigned launches = 4;
    const std::size_t n = c.horizon > 10 || c.mu > 2 ? 250 : 125;
    for (const std::size_t level : {0, 1})
      for (unsigned l = 0; l < launches; ++l) {
        FilterOptions o = tbba(construct_lyons_victoir_5_1(), 1000);
        o.launch = l;
        const auto filter = make_filter(model, o);
        run(*filter, ObservationWindows(path, model.observation, model.timing, level == 0 ? n : 2 * n), {});
        value[level] += filter->posterior().log_evidence / launches;
        if (level == 1) square += std::pow(filter->posterior().log_evidence, 2) / launches;
      }
    const double sd = std::sqrt(std::max(0.0, square - value[1] * value[1]) / (launches - 1));
    const double tolerance = 2 * std::abs(value[1] - value[0]) / 3 + 4 * sd + 1e-3;
    INFO("problem " << c.name << ": exact " << exact.posterior().log_evidence << ", KLV " << value[1]
                    << " +- " << tolerance);
    CHECK(value[1] == Approx(exact.posterior().log_evidence).margin(tolerance));
    CHECK(tolerance < 0.1);
  }
}

TEST_CASE("version 1 and version 2 weights agree within their Monte-Carlo error") {
  const BenesCase& c = benes_cases[3];
  const Model model = c.model();
  const auto path = simulate(model, 4, 4000, 4000, 2).observations;
  const ObservationWindows windows(path, model.observation, model.timing, 40);
  const auto mean_and_error = [&](PruneWeights prune) {
    double sum = 0, squares = 0;
    constexpr int launches = 20;
    for (int l = 0; l < launches; ++l) {
      FilterOptions o = tbba(construct_lyons_victoir_5_1(), 1000);
      o.prune_weights = prune;
      o.launch = static_cast<std::uint32_t>(l);
      const auto filter = make_filter(model, o);
      run(*filter, windows, {});
      const double m = mean(filter->posterior(), 0);
      sum += m;
      squares += m * m;
    }
    const double m = sum / launches;
    return std::pair{m, std::sqrt((squares / launches - m * m) / (launches - 1))};
  };
  const auto [m1, e1] = mean_and_error(PruneWeights::cubature);
  const auto [m2, e2] = mean_and_error(PruneWeights::likelihood);
  INFO("cubature " << m1 << " +- " << e1 << ", likelihood " << m2 << " +- " << e2);
  // Null hypothesis: equal means (both are unbiased up to O(1/N)). |t| > 7.5 on about 38 degrees of freedom:
  // 5e-9.
  CHECK(std::abs(m1 - m2) < 7.5 * std::hypot(e1, e2));
  CHECK(e1 < 0.02);
}

TEST_CASE("the same seed gives the same bytes for any number of threads, another seed does not",
          "[threads]") {
  const Model model = benes_cases[2].model();
  const auto path = simulate(model, 2, 2000, 2000, 2).observations;
  const ObservationWindows windows(path, model.observation, model.timing, 20);
  const auto run_with = [&](unsigned threads, std::uint64_t seed) {
    FilterOptions o = tbba(construct_lyons_victoir_5_1(), 3000);
    o.threads = threads;
    o.seed = seed;
    const auto filter = make_filter(model, o);
    run(*filter, windows, {});
    const Posterior& p = filter->posterior();
    return std::vector<double>{p.log_evidence, mean(p, 0), raw_moment(p, 0, 3), static_cast<double>(p.kept)};
  };
  const auto one = run_with(1, 5);
  CHECK(one == run_with(2, 5));
  CHECK(one == run_with(3, 5));
  CHECK(one == run_with(8, 5));
  CHECK(one != run_with(1, 6));
}

TEST_CASE("a posterior without mass is an error that names step and observation") {
  Model model = benes_cases[2].model();
  ObservationPath path;
  path.dimension = 1;
  for (int r = 0; r <= 4; ++r) path.append(r, std::vector{r < 2 ? 0.1 * r : 1e308 * (r - 1)});
  const auto filter = make_filter(model, tbba(construct_degree_3(1), 4));
  try {
    run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
    FAIL("accepted");
  } catch (const RunError& e) {
    CHECK_THAT(e.where(), Catch::Contains("step"));
    CHECK_THAT(e.where(), Catch::Contains("t = "));
  }
}

TEST_CASE("options that do not fit are refused") {
  const Model model = benes_cases[2].model();
  FilterOptions o = tbba(construct_degree_3(2), 10);
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  o = tbba(construct_degree_3(1), 0);
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  o = tbba(construct_degree_3(1), 10);
  o.threads = 0;
  CHECK_THROWS_AS(make_filter(model, o), InputError);
  o.threads = 1;
  o.method = FilterMethod::full_tree;
  CHECK_THROWS_WITH(refuse_oversized_tree(model, o, 200), Catch::Contains("--thin recombination"));
  CHECK_NOTHROW(refuse_oversized_tree(model, o, 10));
  o.method = FilterMethod::benes;
  CHECK_THROWS_AS(make_filter(parse_model(two_dimensional, "two.toml", {}), o), InputError);
}
