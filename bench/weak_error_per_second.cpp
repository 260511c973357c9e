/// Weak approximation: error against processor time, in one run. A European call in Heston's model, S0 = 100, K = 105,
/// r 0.02, kappa 1.5, theta 0.05, v0 0.04, xi 0.4, rho -0.5, T 0.75 as a year of 365 days has it (274 days),
/// undiscounted; the exact value is that of Lewis' integral.
///
///     build/bench/bench/weak_error_per_second [TABLE.csv]         (about two minutes)
///     bench/draw-weak-error TABLE.csv PICTURE.svg
///
/// Methods that draw show the root of squared error plus squared standard error of one run; the others their
/// error.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "heston_rivals.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/numeric/random.hpp"
#include "wienertree/tree/square_root_transition.hpp"
#include "wienertree/weak/conditional_price.hpp"
#include "wienertree/weak/run.hpp"

using namespace wienertree;

namespace {

constexpr const char* heston = R"TOML(
name = "heston"
convention = "ito"
[parameters]
r = 0.02
kappa = 1.5
theta = 0.05
xi = 0.4
rho = -0.5
[state]
s = { initial = 100.0 }
v = { initial = 0.04, lower = 0.0, boundary = "clamp" }
[drift]
s = "r*s"
v = "kappa*(theta - v)"
[diffusion]
s = ["sqrt(v)*s", "0"]
v = ["rho*xi*sqrt(v)", "xi*sqrt((1-rho^2)*v)"]
)TOML";

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

bench::MonteCarloResult euler_monte_carlo(const Model& model, const BatchFunction& payoff, double horizon,
                                          std::size_t steps, std::size_t paths) {
  constexpr std::size_t block = 1024;
  const double s = horizon / static_cast<double>(steps);
  const std::size_t d = model.state_dimension(), p = model.noise_dimension();
  Batch x(d, block), next(d, block), dB(p, block);
  std::vector<double> value(block);
  double sum = 0, squares = 0;
  for (std::size_t first = 0; first < paths; first += block) {
    for (std::size_t i = 0; i < d; ++i) std::ranges::fill(x.component(i), model.initial[i]);
    for (std::size_t j = 0; j < steps; ++j) {
      for (std::size_t r = 0; r < p; ++r) {
        const RandomStream random{1, static_cast<std::uint32_t>(r), static_cast<std::uint32_t>(j),
                                  Purpose::euler_noise};
        random.normals(first, dB.component(r));
        for (double& v : dB.component(r)) v *= std::sqrt(s);
      }
      model.fields->euler_step(x, s, dB, next);
      x.swap(next);
    }
    payoff(x, value);
    for (const double v : value) {
      sum += v;
      squares += v * v;
    }
  }
  const auto n = static_cast<double>((paths + block - 1) / block * block);
  return {sum / n, std::sqrt((squares / n - sum / n * (sum / n)) / n)};
}

class Table {
 public:
  explicit Table(std::FILE* csv) : csv_(csv) {
    if (csv_ != nullptr) fmt::print(csv_, "method,steps,size,error,seconds\n");
    fmt::print(
        "| method | steps | paths or nodes | value | error | processor s |\n|---|---|---|---|---|---|\n");
  }

  /// run() gives value and standard error.
  template <class Run>
  void row(const std::string& method, std::size_t steps, std::size_t size, Run run) {
    const double start = processor_seconds();
    const bench::MonteCarloResult r = run();
    const double seconds = processor_seconds() - start;
    const double error = std::hypot(r.value - bench::HestonCall::exact, r.standard_error);
    fmt::print("| {} | {} | {} | {:.6f} | {:.1e} | {:.3g} |\n", method, steps, size, r.value, error, seconds);
    std::fflush(stdout);
    if (csv_ != nullptr) fmt::print(csv_, "{},{},{},{:.6g},{:.6g}\n", method, steps, size, error, seconds);
  }

 private:
  std::FILE* csv_;
};

}  // namespace

int main(int argc, char** argv) {
  std::FILE* csv = argc > 1 ? std::fopen(argv[1], "w") : nullptr;
  if (argc > 1 && csv == nullptr) {
    fmt::print(stderr, "{} cannot be written\n", argv[1]);
    return 1;
  }
  const TextModel text = TextModel::parse(heston, "heston");
  const Model& model = text.model();
  const BatchFunction payoff = text.compile("max(s - 105, 0)", "payoff");
  const bench::HestonCall call;
  using Sizes = std::vector<std::pair<std::size_t, std::size_t>>;
  Table table(csv);
#ifdef WIENERTREE_QUANTLIB
  for (const auto& [steps, paths] : Sizes{{10, 10'000}, {10, 100'000}, {20, 400'000}})
    table.row("QuantLib Monte Carlo", steps, paths,
              [&] { return bench::quantlib_heston(call, steps, paths, 1); });
  for (const auto& [steps, paths] : Sizes{{10, 16'383}, {20, 131'071}})
    table.row("QuantLib Sobol", steps, paths,
              [&] { return bench::quantlib_heston_sobol(call, steps, paths); });
  for (const std::size_t n : {12U, 25U, 50U, 100U, 200U})
    table.row("QuantLib finite differences", n, 4 * n * n,
              [&] { return bench::quantlib_heston_fd(call, n, 4 * n, n); });
#else
  fmt::print(stderr, "built without QuantLib (Debian: libquantlib0-dev): its rows are left out\n");
#endif
  for (const auto& [steps, paths] : Sizes{{10, 10'000}, {50, 100'000}, {200, 1'000'000}, {500, 4'000'000}})
    table.row("Euler Monte Carlo", steps, paths,
              [&] { return euler_monte_carlo(model, payoff, call.horizon, steps, paths); });
  const CubatureFormula five = construct(5, 2);
  const auto tree = [&](const std::string& method, std::size_t steps, std::size_t N, ThinningOptions thinning,
                        std::uint32_t launches, bool richardson) {
    table.row(method, steps, N, [&] {
      WeakRun run;
      run.options.formula = five;
      run.options.nodes = N;
      run.options.thinning = thinning;
      run.horizon = call.horizon;
      run.steps = steps;
      run.launches = launches;
      run.richardson = richardson;
      const WeakResult r = run_weak(model, {payoff}, run);
      return richardson ? bench::MonteCarloResult{r.extrapolated[0], r.extrapolated_standard_error[0]}
                        : bench::MonteCarloResult{r.value[0], r.standard_error[0]};
    });
  };
  const ThinningOptions recombination = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  for (const auto& [steps, N] : Sizes{{5, 1'000}, {10, 10'000}, {20, 100'000}})
    tree("sampled tree", steps, N, {ThinningMethod::tbba, SiteOrder::tree, 0}, 10, false);
  for (const auto& [steps, N] : Sizes{{5, 1'000}, {10, 10'000}, {20, 50'000}})
    tree("TBBA in spatial order", steps, N, {ThinningMethod::tbba, SiteOrder::spatial, 0}, 4, false);
  const Sizes recombined = {{4, 300}, {8, 1'000}, {16, 3'000}, {32, 10'000}};
  for (const auto& [steps, N] : recombined) tree("recombined tree", steps, N, recombination, 1, false);
  for (const auto& [steps, N] : recombined)
    tree("recombined tree, extrapolated", steps, N, recombination, 1, true);
  // The model as it is written above: its variance moves by the exact transition, its price is integrated out.
  const TextModel moved = text.without_price();
  const ConditionalPrice price(*text.square_roots(), model.initial);
  const BatchFunction smooth = price.average_of_rest(payoff, {text.compile("s - 105", "kink")}, call.horizon);
  for (const auto& [steps, N] : Sizes{{2, 64}, {3, 64}, {4, 64}, {6, 128}, {8, 200}, {16, 400}, {32, 1'000}})
    table.row("exact transition", steps, N, [&] {
      WeakRun run;
      run.options.formula = five;  // only its degree has a meaning: rules of four nodes
      run.options.formula.degree = 7;
      run.options.transition = std::make_shared<SquareRootTransition>(*moved.square_roots());
      run.options.nodes = N;
      run.options.thinning = recombination;
      run.horizon = call.horizon;
      run.steps = steps;
      WeakPayoff averaged(smooth);
      averaged.at_times = {smooth};  // over the nodes that thinning leaves
      return bench::MonteCarloResult{run_weak(moved.model(), {averaged}, run).value[0], 0};
    });
  if (csv != nullptr && std::fclose(csv) != 0) {
    fmt::print(stderr, "{} cannot be written\n", argv[1]);
    return 1;
  }
}
