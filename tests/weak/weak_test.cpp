/// The iterated KLV operator: against an operator written out, against itself sampled, against closed forms.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "numeric/statistics.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/model/cpp_model.hpp"
#include "wienertree/weak/control.hpp"
#include "wienertree/weak/journal.hpp"
#include "wienertree/weak/levels.hpp"
#include "wienertree/weak/slabs.hpp"

using namespace wienertree;

namespace {

/// Bounded fields that do not commute, of two components and two Brownian motions.
struct Bent : CppModel<2, 2> {
  static constexpr auto convention = Convention::stratonovich;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {-0.5 * x[1], 0.3 * cos(x[0])};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{0.4 * cos(x[1]), T(0.1)}, {T(0.2), 0.3 * sin(x[0]) + 0.5}}};
  }
};

/// dX = (r - s^2/2) X dt + s X o dB, discounted at the rate X: the last component is the integral.
struct Discounted : CppModel<2, 1> {
  static constexpr auto convention = Convention::stratonovich;
  template <class T>
  State<T> drift(const State<T>& x) const {
    return {0.03 * x[0], x[0]};
  }
  template <class T>
  Diffusion<T> diffusion(const State<T>& x) const {
    return {{{0.2 * x[0]}, {T(0)}}};
  }
};

Model bent() { return make_model(Bent{}, {.name = "bent", .initial = {0.2, -0.1}}); }

BatchFunction smooth_payoff() {
  return [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::sin(x(0, n)) + x(1, n) * x(1, n);
  };
}

BatchFunction component(std::size_t i) {
  return [i](ConstBatchView x, std::span<double> out) {
    std::copy(x.component(i).begin(), x.component(i).end(), out.begin());
  };
}

/// The operator written out: recursion over paths, one node at a time.
double klv(Flow& flow, const CubatureFormula& formula, std::array<double, 2> x, double s, int steps) {
  if (steps == 0) return std::sin(x[0]) + x[1] * x[1];
  double sum = 0;
  for (const CubaturePath& path : formula.paths) {
    Batch node(2, 1);
    node(0, 0) = x[0];
    node(1, 0) = x[1];
    std::vector<NodeFailure> failures;
    flow.move_along(path, s, node, failures);
    sum += path.weight * klv(flow, formula, {node(0, 0), node(1, 0)}, s, steps - 1);
  }
  return sum;
}

WeakRun run_of(ThinningMethod method, SiteOrder order, std::size_t nodes) {
  WeakRun run;
  run.options.formula = construct(5, 2);
  run.options.thinning = {method, order, 0};
  run.options.nodes = nodes;
  run.steps = 5;
  return run;
}

}  // namespace

TEST_CASE("the unpruned tree is the operator iterated") {
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::none, SiteOrder::spatial, 1);
  run.steps = 3;
  run.horizon = 0.9;
  const WeakResult result = run_weak(model, {smooth_payoff(), component(1)}, run);
  const auto flow = make_flow(FlowMethod::automatic, model, run.options.tolerance, 5);
  // Blocks of one node and of 64 solve to the same tolerance of 1e-8 in different steps.
  CHECK(result.value[0] ==
        Approx(klv(*flow, run.options.formula, {0.2, -0.1}, 0.3, 3)).epsilon(0).margin(1e-7));
  CHECK(result.standard_error[0] == 0);
  CHECK(result.leaves == 11 * 11 * 11);
  CHECK(result.discarded == 0);
}

TEST_CASE("sampled trees are unbiased estimates of the unpruned one") {
  const Model model = bent();
  const double exact = run_weak(model, {smooth_payoff()}, run_of(ThinningMethod::none, {}, 1)).value[0];
  constexpr std::uint32_t launches = 400;
  const std::array cases = {std::pair{ThinningMethod::tbba, SiteOrder::tree},
                            std::pair{ThinningMethod::tbba, SiteOrder::spatial},
                            std::pair{ThinningMethod::systematic, SiteOrder::tree},
                            std::pair{ThinningMethod::multinomial, SiteOrder::tree}};
  for (const auto& [method, order] : cases) {
    WeakRun run = run_of(method, order, 200);
    run.launches = launches;
    const WeakResult result = run_weak(model, {smooth_payoff()}, run);
    INFO(static_cast<int>(method) << " " << static_cast<int>(order) << " " << result.standard_error[0]);
    // H0: the mean of a launch is `exact`. The mean of 400 launches of bounded variables over its standard
    // error is Student's t to a good approximation, whose tail at 399 degrees of freedom exceeds the normal
    // bound's by less than a factor of 2: false alarms below 2e-7 in all.
    CHECK(std::abs(result.value[0] - exact) <
          wienertree_test::normal_bound(cases.size()) * result.standard_error[0]);
    CHECK(result.standard_error[0] < 2e-2);
  }
}

TEST_CASE("in tree order only the chosen children are moved") {
  const Model model = bent();
  const std::size_t segments = 4;  // at most, of a path of this formula
  const WeakResult chosen =
      run_weak(model, {component(0)}, run_of(ThinningMethod::tbba, SiteOrder::tree, 100));
  const WeakResult all =
      run_weak(model, {component(0)}, run_of(ThinningMethod::tbba, SiteOrder::spatial, 100));
  CHECK(chosen.ode_solves <= 5 * 100 * segments);
  CHECK(chosen.leaves <= 100);
  CHECK(all.ode_solves > 3 * 100 * 11);
}

TEST_CASE("a computation put down after any step is taken up to the same bytes", "[threads]") {
  const Model model = bent();
  for (const auto& [method, order] : {std::pair{ThinningMethod::recombination, SiteOrder::spatial},
                                      std::pair{ThinningMethod::tbba, SiteOrder::tree},
                                      std::pair{ThinningMethod::tbba, SiteOrder::spatial}}) {
    WeakRun run = run_of(method, order, 60);
    run.launches = method == ThinningMethod::tbba ? 3 : 1;
    run.richardson = true;
    const WeakResult whole = run_weak(model, {smooth_payoff(), component(1)}, run);
    WeakJournal journal;
    std::vector<std::string> states;
    run.options.journal = &journal;
    run.options.observe = [&](std::size_t) {
      StateArchive archive;
      journal.exchange(archive);
      states.push_back(archive.bytes());
    };
    CHECK(run_weak(model, {smooth_payoff(), component(1)}, run).value == whole.value);
    REQUIRE(states.size() == run.launches * (5 + 3));
    run.options.threads = 2;
    for (std::size_t put_down = 0; put_down < states.size(); ++put_down) {
      WeakJournal taken_up;
      StateArchive archive(states[put_down]);
      taken_up.exchange(archive);
      std::size_t steps = put_down + 1;
      run.options.journal = &taken_up;
      run.options.observe = [&](std::size_t) { ++steps; };
      const WeakResult result = run_weak(model, {smooth_payoff(), component(1)}, run);
      REQUIRE(result.value == whole.value);
      REQUIRE(result.extrapolated == whole.extrapolated);
      REQUIRE(result.standard_error == whole.standard_error);
      REQUIRE(result.ode_solves == whole.ode_solves);
      REQUIRE(result.leaves == whole.leaves);
      REQUIRE(result.discarded == whole.discarded);
      REQUIRE(steps == states.size());  // none was made again
    }
    WeakJournal damaged;
    StateArchive archive(std::string_view(states.back()).substr(0, states.back().size() - 9));
    CHECK_THROWS_AS(damaged.exchange(archive), InputError);
  }
}

TEST_CASE("any number of threads gives the same bytes", "[threads]") {
  const Model model = bent();
  for (const auto method : {ThinningMethod::none, ThinningMethod::tbba, ThinningMethod::recombination})
    for (const auto order : {SiteOrder::tree, SiteOrder::spatial}) {
      WeakRun run = run_of(method, order, 3000);
      const double one = run_weak(model, {smooth_payoff()}, run).value[0];
      run.options.threads = 3;
      CHECK(run_weak(model, {smooth_payoff()}, run).value[0] == one);
    }
}

TEST_CASE("recombination reproduces the unpruned tree on a smooth payoff") {
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::none, {}, 1);
  const double exact = run_weak(model, {smooth_payoff()}, run).value[0];
  run.options.thinning.method = ThinningMethod::recombination;
  run.options.nodes = 300;
  const WeakResult thinned = run_weak(model, {smooth_payoff()}, run);
  CHECK(thinned.leaves <= 300 * 11);
  CHECK(thinned.value[0] == Approx(exact).epsilon(0).margin(1e-5));
  CHECK(thinned.discarded > 0);
}

TEST_CASE("the error of thinning along a direction falls with the nodes") {
  // Slabs that became ever thinner with the nodes, their patches as wide across, would leave 1e-6 for ever.
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::none, {}, 1);
  const BatchFunction square = [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::exp(x(0, n) - 2 * x(1, n));
  };
  const double exact = run_weak(model, {square}, run).value[0];
  run.options.thinning.method = ThinningMethod::recombination;
  run.options.finest_along = component(0);
  const auto error = [&](std::size_t nodes) {
    run.options.nodes = nodes;
    return std::abs(run_weak(model, {square}, run).value[0] - exact);
  };
  CHECK(error(400) < 1e-2);
  CHECK(error(6400) < 1e-7);
}

TEST_CASE("a discount state is folded into the weights") {
  const Model model = make_model(Discounted{}, {.name = "discounted", .initial = {0.5, 0}});
  const auto explicit_payoff = [](ConstBatchView x, std::span<double> out) {
    for (std::size_t n = 0; n < out.size(); ++n) out[n] = std::exp(-x(1, n)) * x(0, n);
  };
  WeakRun run;
  run.options.formula = construct(5, 1);
  run.options.thinning.method = ThinningMethod::none;
  run.steps = 6;
  const double value = run_weak(model, {explicit_payoff}, run).value[0];
  run.options.discount_state = 1;
  const WeakResult folded = run_weak(model, {component(0), component(1)}, run);
  CHECK(folded.value[0] == Approx(value).epsilon(1e-7));  // the tolerance of the flow
  CHECK(folded.value[1] == 0);                            // starts from 0 again
  run.options.thinning = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  run.options.nodes = 40;
  CHECK(run_weak(model, {component(0)}, run).value[0] == Approx(value).epsilon(1e-7));
  run.options.discount_state = 2;
  CHECK_THROWS_WITH(run_weak(model, {component(0)}, run), Catch::Contains("discount_state"));
}

TEST_CASE("extrapolation removes the leading error") {
  const auto value = [](double n) { return 7 + 3 * std::pow(n, -3); };
  CHECK(extrapolate(value(4), value(8), 4, 8, 7) == Approx(7).epsilon(1e-14));
  CHECK(extrapolate(value(3), value(5), 3, 5, 7) == Approx(7).epsilon(1e-14));
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::none, {}, 1);
  const WeakResult fine = run_weak(model, {smooth_payoff()}, run);
  run.richardson = true;
  const WeakResult both = run_weak(model, {smooth_payoff()}, run);
  CHECK(both.value == fine.value);
  run.steps = 3;
  run.richardson = false;
  const double coarse = run_weak(model, {smooth_payoff()}, run).value[0];
  CHECK(both.extrapolated[0] == extrapolate(coarse, fine.value[0], 3, 5, 5));
  CHECK(both.ode_solves > fine.ode_solves);
}

TEST_CASE("the estimate of what the steps leave") {
  // Where the order is not seen: V_n = 7 + 3 n^{-1/2} leaves X_n - 7 = 3 n^{-1/2} (1 - (2^{1/2} - 1)/3).
  const auto V = [](double n) { return 7 + 3 / std::sqrt(n); };
  const std::array slow = {V(16), V(8), V(4), V(2)};
  CHECK(discretisation_estimate(slow, 5) == Approx(0.75 * (1 - (std::sqrt(2.0) - 1) / 3)));
  // X_8 = X_4 by chance, and V falls by 4 as it should: what is left is (X_4 - X_2) / 2^{q+2} = 3/16.
  CHECK(discretisation_estimate(std::array{0.0, 1.0, 5.0, 30.0}, 5) == Approx(3.0 / 16));
  // V_n = n^{-2} + n^{-3}: X_n = -4/3 n^{-3}, of which |X_n - X_{n/2}| is 7 times.
  const auto W = [](double n) { return 1 / (n * n) + 1 / (n * n * n); };
  CHECK(discretisation_estimate(std::array{W(16), W(8), W(4), W(2)}, 5) == Approx(28.0 / 3 / 4096));
  CHECK(discretisation_estimate(std::array{2.0, 2.0, 2.0}, 7) == 0);
}

TEST_CASE("levels are the trees of a run, launch by launch") {
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::tbba, SiteOrder::spatial, 60);
  run.launches = 6;
  run.richardson = true;
  run.steps = 8;
  const std::vector<WeakPayoff> payoffs = {smooth_payoff(), component(1)};
  const WeakResult result = run_weak(model, payoffs, run);
  WeakLevels levels(model, payoffs, run);
  levels.set_launches(2);
  CHECK(levels.value(8) != result.value);
  levels.set_launches(6);
  for (std::size_t i = 0; i < payoffs.size(); ++i) {
    CHECK(levels.value(8)[i] == Approx(result.value[i]).epsilon(1e-13));
    CHECK(levels.extrapolated(8)[i] == Approx(result.extrapolated[i]).epsilon(1e-13));
    CHECK(levels.standard_error(8)[i] > 0);
    CHECK(levels.standard_error(8)[i] == Approx(result.extrapolated_standard_error[i]).epsilon(1e-9));
  }
  CHECK(levels.extrapolated(1) == levels.value(1));
  CHECK(levels.ode_solves() == result.ode_solves + levels.ode_solves(1));
}

TEST_CASE("the error of thinning is told where only the finest tree is thinned") {
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::recombination, {}, 200);  // 11^2 nodes with 2 steps, 11^4 with 4
  WeakTarget target;
  target.tolerance = 1;
  target.formulas = {run.options.formula};
  target.choose_nodes = false;
  const ControlledResult result = weak_to_tolerance(model, {{WeakPayoff(smooth_payoff())}}, run, target);
  CHECK(result.run.steps == 4);
  run.options.thinning.method = ThinningMethod::none;
  const double whole = weak_to_tolerance(model, {{WeakPayoff(smooth_payoff())}}, run, target).value[0];
  CHECK(result.error[0].thinning > 0);
  CHECK(std::abs(result.value[0] - whole) <= result.error[0].thinning);
}

TEST_CASE("what cannot be run is refused with the reason") {
  const Model model = bent();
  WeakRun run = run_of(ThinningMethod::none, {}, 1);
  const std::vector<WeakPayoff> payoffs = {component(0)};
  run.steps = 40;
  CHECK_THROWS_WITH(run_weak(model, payoffs, run),
                    Catch::Contains("11^40") && Catch::Contains("--thin recombination --nodes"));
  run = run_of(ThinningMethod::recombination, {}, std::size_t{1} << 40);
  CHECK_THROWS_WITH(run_weak(model, payoffs, run), Catch::Contains("fewer nodes"));
  run = run_of(ThinningMethod::recombination, {}, 100);
  run.options.formula = construct(5, 1);
  CHECK_THROWS_WITH(run_weak(model, payoffs, run), Catch::Contains("2 Brownian motions"));
  run = run_of(ThinningMethod::recombination, {}, 100);
  run.launches = 0;
  CHECK_THROWS_WITH(run_weak(model, payoffs, run), Catch::Contains("launches"));
  run.launches = 1;
  run.steps = 1;
  run.richardson = true;
  CHECK_THROWS_WITH(run_weak(model, payoffs, run), Catch::Contains("2 steps"));
  run.richardson = false;
  const BatchFunction pole = [](ConstBatchView, std::span<double> out) {
    std::fill(out.begin(), out.end(), std::nan(""));
  };
  CHECK_THROWS_WITH(run_weak(model, {component(0), pole}, run), Catch::Contains("payoff 2"));
}

TEST_CASE("slabs keep mass and mean, and each site at most once") {
  Generation sites;
  constexpr std::size_t count = 3000;
  sites.states.reshape(2, count);
  std::vector<double> value(count);
  const RandomStream random{7, 0, 0, Purpose::thinning};
  for (std::size_t n = 0; n < count; ++n) {
    sites.states(0, n) = random.uniform(2 * n);
    sites.states(1, n) = random.uniform(2 * n + 1);
    sites.log_weight.push_back(std::log(random.uniform(10000 + n) / count));
    value[n] = sites.states(0, n) - sites.states(1, n);
  }
  const auto thinning = make_thinning({ThinningMethod::recombination, SiteOrder::spatial, 0});
  Slabs slabs;
  Selection selection;
  slabs.thin(sites, value, 400, random, *thinning, selection);
  CHECK(selection.site.size() <= 400);
  std::vector<std::uint32_t> once = selection.site;
  std::sort(once.begin(), once.end());
  CHECK(std::adjacent_find(once.begin(), once.end()) == once.end());
  double before[4] = {}, after[4] = {};
  const auto add = [&](double* sum, std::size_t n, double w) {
    const double x = sites.states(0, n), y = sites.states(1, n);
    sum[0] += w, sum[1] += w * x, sum[2] += w * x * y, sum[3] += w * std::max(value[n], 0.0);
  };
  for (std::size_t n = 0; n < count; ++n) add(before, n, std::exp(sites.log_weight[n]));
  for (std::size_t k = 0; k < selection.site.size(); ++k)
    add(after, selection.site[k], std::exp(selection.log_weight[k]));
  // Moments to degree 2 are kept to 1e-12 a patch; the kink lies in one of 8 slabs, across which the mean of
  // max(value, 0) may change by a part of its width 0.2 times its mass 1/8 of 0.5.
  for (int i = 0; i < 3; ++i) CHECK(std::abs(after[i] - before[i]) < 1e-11);
  CHECK(std::abs(after[3] - before[3]) < 0.2 / 8 * 0.5);
}
