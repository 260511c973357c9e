// The Runge-Kutta pairs: their coefficients, their observed orders, their error estimates and their kernels.
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstring>
#include <random>

#include <arkode/arkode_butcher_erk.h>  // needs <cstdio>

#include "cubature/flow_cases.hpp"
#include "cubature/reference_flow.hpp"
#include "cubature/rooted_trees.hpp"
#include "wienertree/cubature/runge_kutta_block.hpp"
#include "wienertree/cubature/runge_kutta_pairs.hpp"

using namespace wienertree;
using namespace wienertree::test;

namespace {

const RungeKuttaPair& pair_of_order(int order) { return order == 5 ? cash_karp_5() : prince_dormand_8(); }

Tableau tableau(const RungeKuttaPair& pair) {
  Tableau A;
  for (std::size_t i = 0; i < static_cast<std::size_t>(pair.stages); ++i)
    A.emplace_back(pair.row(i).begin(), pair.row(i).end());
  return A;
}

std::vector<double> difference(std::span<const double> x, std::span<const double> y) {
  std::vector<double> result;
  for (std::size_t i = 0; i < x.size(); ++i) result.push_back(x[i] - y[i]);
  return result;
}

/// One step of length h from each node of `start`.
struct Steps {
  Batch results;
  std::vector<double> squared_errors;
};

Steps step(const RungeKuttaPair& pair, const Model& model, const std::vector<double>& D, ConstBatchView start,
           double h, FlowTolerance tolerance = {}) {
  SegmentField field(model);
  RungeKuttaBlock block(start.components(), tolerance);
  const RungeKuttaBlock::Method method(pair, block);
  Steps steps{Batch(start.components(), start.nodes()), {}};
  for (std::size_t first = 0; first < start.nodes(); first += RungeKuttaBlock::lanes) {
    const std::size_t count = std::min(RungeKuttaBlock::lanes, start.nodes() - first);
    for (std::size_t n = 0; n < count; ++n) {
      block.step_sizes(count)[n] = h;
      for (std::size_t i = 0; i < start.components(); ++i) block.states(count)(i, n) = start(i, first + n);
    }
    block.attempt(method, field, D, count);
    for (std::size_t n = 0; n < count; ++n) {
      steps.squared_errors.push_back(block.squared_errors(count)[n]);
      for (std::size_t i = 0; i < start.components(); ++i)
        steps.results(i, first + n) = block.results(count)(i, n);
    }
  }
  return steps;
}

}  // namespace

TEST_CASE("rooted trees are counted as in the literature") {
  const std::vector<std::size_t> known = {1, 1, 2, 4, 9, 20, 48, 115, 286};  // OEIS A000081
  std::vector<std::size_t> found(known.size(), 0);
  for (const RootedTree& tree : rooted_trees(known.size())) ++found[tree.nodes - 1];
  CHECK(found == known);
}

// Every row satisfies its order conditions up to 32 units of rounding error and misses those of the next
// order by more than a thousand times that.
TEST_CASE("each row of each pair has exactly its stated order") {
  const std::vector<RootedTree> trees = rooted_trees(9);
  for (const int order : {5, 8}) {
    const RungeKuttaPair& pair = pair_of_order(order);
    const Tableau A = tableau(pair);
    double next = 0;
    CAPTURE(pair.name);
    CHECK(order_of(trees, A, pair.b, 32, &next) == static_cast<std::size_t>(pair.order));
    CHECK(next > 32e3);
    CHECK(order_of(trees, A, difference(pair.b, pair.e), 32, &next) ==
          static_cast<std::size_t>(pair.estimate_order));
    CHECK(next > 32e3);
    CHECK(order_of(trees, A, difference(pair.b, pair.g), 32, &next) ==
          static_cast<std::size_t>(pair.guard_order));
    CHECK(next > 32e3);
    CHECK(pair.guard_order * pair.guard_power > 2 * pair.estimate_order);
  }
}

TEST_CASE("the order conditions agree with ARKODE's") {
  const std::vector<RootedTree> trees = rooted_trees(9);
  // Its own pair of order 8, which the library does not use: the estimate of its error vanishes for a
  // quadrature.
  const ARKodeButcherTable fehlberg = ARKodeButcherTable_LoadERK(ARKODE_FEHLBERG_13_7_8);
  Tableau A;
  for (int i = 0; i < fehlberg->stages; ++i)
    A.emplace_back(fehlberg->A[i], fehlberg->A[i] + fehlberg->stages);
  const auto stages = static_cast<std::size_t>(fehlberg->stages);
  CHECK(order_of(trees, A, {fehlberg->b, stages}, 32) == 8);
  CHECK(order_of(trees, A, {fehlberg->d, stages}, 32) == 7);
  ARKodeButcherTable_Free(fehlberg);

  const ARKodeButcherTable theirs = ARKodeButcherTable_LoadERK(ARKODE_CASH_KARP_6_4_5);
  const RungeKuttaPair& ours = cash_karp_5();
  REQUIRE(theirs->stages == ours.stages);
  for (std::size_t i = 0; i < 6; ++i) {
    // The same rational numbers, up to the rounding of a quotient and a difference.
    CHECK(ours.b[i] == Approx(theirs->b[i]).epsilon(0).margin(1e-15));
    CHECK(ours.b[i] - ours.e[i] == Approx(theirs->d[i]).epsilon(0).margin(1e-15));
    for (std::size_t j = 0; j < i; ++j) CHECK(ours.row(i)[j] == Approx(theirs->A[i][j]).epsilon(1e-15));
  }
  ARKodeButcherTable_Free(theirs);
}

// A step of length h along D is the segment h D. One step errs by O(h^(p+1)), its estimate per unit of u is
// O(h^q). Slopes between h, h/2 and h/4, on Lorenz's equations, averaged over nodes (in logarithms).
TEST_CASE("halving the step shows the order of each pair and of its estimate") {
  const FlowCase& problem = *std::find_if(flow_cases().begin(), flow_cases().end(),
                                          [](const FlowCase& c) { return c.model.name == "Lorenz"; });
  const std::vector<double> D = {1.0, 0.5};
  for (const int order : {5, 8}) {
    const RungeKuttaPair& pair = pair_of_order(order);
    double error_slope = 0, estimate_slope = 0, previous_error = 0, previous_estimate = 0;
    constexpr int halvings = 2;
    double h = order == 5 ? 0.008 : 0.08;
    for (int k = 0; k <= halvings; ++k, h /= 2) {
      const Steps steps = step(pair, problem.model, D, problem.nodes, h);
      double log_error = 0, log_estimate = 0;
      for (std::size_t n = 0; n < problem.nodes.nodes(); ++n) {
        const std::vector<double> scaled = {h * D[0], h * D[1]};
        std::vector<double> x;
        for (std::size_t i = 0; i < 3; ++i) x.push_back(problem.nodes(i, n));
        const std::vector<double> end =
            reference_flow([&](const long double* y,
                               long double* out) { Lorenz{}.field<long double>(y, scaled.data(), out); },
                           x);
        double error = 0;
        for (std::size_t i = 0; i < 3; ++i) error = std::max(error, std::abs(steps.results(i, n) - end[i]));
        log_error += std::log2(error) / double(problem.nodes.nodes());
        log_estimate += 0.5 * std::log2(steps.squared_errors[n]) / double(problem.nodes.nodes());
      }
      if (k > 0) {
        error_slope += (previous_error - log_error) / halvings;
        estimate_slope += (previous_estimate - log_estimate) / halvings;
      }
      previous_error = log_error;
      previous_estimate = log_estimate;
    }
    CAPTURE(pair.name, error_slope, estimate_slope, previous_error);
    CHECK(std::abs(error_slope - (pair.order + 1)) < 0.2);
    CHECK(std::abs(estimate_slope - pair.estimate_order) < 0.2);
  }
}

// Steps of lengths at which between a third and nearly all are refused: there an estimate vanishes by
// accident for some nodes. Without the guards errors of 300 tolerances (order 5) and 17 (order 8) pass here.
TEST_CASE("no step passes by accident") {
  const Model model = model_of("tanh", Tanh{2.2, 2.2}, {0.0});
  const FlowTolerance tolerance;
  std::mt19937_64 random(3);
  std::normal_distribution<> normal(0.0, 2.0);
  Batch start(1, 4000);
  for (double& value : start.component(0)) value = normal(random);
  const auto precise = make_flow(FlowMethod::explicit_, model, {1e-13, 1e-15}, 7);
  for (const int order : {5, 8})
    for (double s = order == 5 ? 0.004 : 0.023; s < (order == 5 ? 0.1 : 1.1); s *= std::sqrt(2.0)) {
      std::size_t passed = 0;
      double worst = 0;
      for (const double sign : {1.0, -1.0}) {
        const std::vector<double> D = {s, sign * 1.7 * std::sqrt(s)};
        const Steps steps = step(pair_of_order(order), model, D, start, 1.0, tolerance);
        Batch end = copy(start);
        std::vector<NodeFailure> failures;
        precise->move(D, end, failures);
        for (std::size_t n = 0; n < start.nodes(); ++n) {
          if (!(steps.squared_errors[n] <= 1.0)) continue;
          ++passed;
          worst = std::max(worst, error_in_tolerances(steps.results.view().nodes(n, 1),
                                                      end.view().nodes(n, 1), tolerance));
        }
      }
      CAPTURE(order, s, passed);
      CHECK(worst <= 10);
    }
}

// A sum of six products: kernels without a fused multiply-add differ from the others by the rounding of the
// products, at most 6 eps times the sum of their sizes, and the largest of three components does not cancel
// to less than a thousandth of that.
TEST_CASE("kernels return the same bits where they fuse, and the same up to rounding where not") {
  constexpr std::size_t d = 3, lanes = 64;
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  std::mt19937_64 random(5);
  std::normal_distribution<> normal;
  std::vector<double> x(d * lanes), h(lanes), stages(5 * d * lanes);
  for (auto* values : {&x, &h, &stages})
    for (double& value : *values) value = normal(random);
  stages[7] = std::nan("");
  std::vector<StageTerm> terms;
  for (std::size_t t = 0; t < 5; ++t) terms.push_back({stages.data() + t * d * lanes, normal(random)});
  const auto total = [&](std::size_t count, std::size_t at, bool absolute) {
    double sum = 0;
    for (const StageTerm& term : std::span(terms).first(count))
      sum += absolute ? std::abs(term.stage[at] * term.coefficient) : term.stage[at] * term.coefficient;
    return sum;
  };
  std::vector<std::vector<double>> combined, results, errors;
  for (const RungeKuttaKernel& kernel : runge_kutta_kernels())
    for (const std::size_t count : {std::size_t{16}, lanes}) {
      const int power = count == 16 ? 3 : 4;
      std::vector<double> out(d * lanes, 0.0), after(d * lanes, 0.0), squared(lanes, 0.0);
      kernel.combine({d, lanes, count}, x.data(), h.data(), terms, out.data());
      kernel.finish({d, lanes, count}, x.data(), h.data(),
                    {terms, std::span(terms).first(4), std::span(terms).first(3), stages.data(), power, 0.1},
                    {1e-3, 1e-4}, after.data(), squared.data());
      CHECK(std::isnan(squared[7]));
      CHECK(std::isfinite(squared[6]));
      CHECK(std::memcmp(out.data(), after.data(), d * lanes * sizeof(double)) == 0);
      for (std::size_t lane = 0; lane < count; ++lane) {
        if (lane == 7) continue;
        double e = 0, g = 0, slope = 0;
        for (std::size_t i = 0; i < d; ++i) {
          const std::size_t at = i * lanes + lane;
          const double b = total(5, at, false), size = std::max(std::abs(x[at]), std::abs(out[at])),
                       unit = 1 / (size * 1e-3 + 1e-4);
          CHECK(std::abs(out[at] - (x[at] + h[lane] * b)) <=
                6 * epsilon * (std::abs(x[at]) + std::abs(h[lane]) * total(5, at, true)));
          e = std::max(e, std::abs(total(4, at, false)) * unit);
          g = std::max(g, std::abs(total(3, at, false)) * unit);
          slope = std::max({slope, std::abs(stages[at]) * unit, std::abs(b) * unit});
        }
        const double worst = std::max(e, 0.1 * g * std::pow(g / slope, power / 2.0 - 1));
        CHECK(squared[lane] == Approx(worst * worst).epsilon(1e-11));
      }
      combined.push_back(out);
      results.push_back(after);
      errors.push_back(squared);
    }
  for (std::size_t k = 4; k < combined.size(); ++k) {
    CHECK(std::memcmp(combined[k].data(), combined[k - 2].data(), d * lanes * sizeof(double)) == 0);
    CHECK(std::memcmp(results[k].data(), results[k - 2].data(), d * lanes * sizeof(double)) == 0);
    CHECK(std::memcmp(errors[k].data(), errors[k - 2].data(), lanes * sizeof(double)) == 0);
  }
}
