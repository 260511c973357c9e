/// Weak approximation: error against processor time, in one run, of four averages (option_problems.hpp): a European call and
/// a digital in Heston's model in plain form, an Asian call in Heston's model, a call on a basket of three assets.
///
///     build/bench/bench/weak_error_per_second [TABLE.csv]         (about three minutes)
///     bench/draw-weak-error TABLE.csv PICTURE.svg
///
/// Methods that draw show the root of squared error plus squared standard error of one run; the others their
/// error. What follows trees thinned by recombination averages kinks and jumps by the law of the last step, as the program does.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "heston_rivals.hpp"
#include "option_problems.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/numeric/random.hpp"
#include "wienertree/tree/square_root_transition.hpp"
#include "wienertree/weak/conditional_price.hpp"
#include "wienertree/weak/run.hpp"

using namespace wienertree;

namespace {

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

using bench::MonteCarloResult;
using Sizes = std::vector<std::pair<std::size_t, std::size_t>>;

class Table {
 public:
  explicit Table(std::FILE* csv) : csv_(csv) {
    if (csv_ != nullptr) fmt::print(csv_, "problem,method,steps,size,error,seconds\n");
    fmt::print(
        "| problem | method | steps | paths, points or nodes | value | error | processor s |\n"
        "|---|---|---|---|---|---|---|\n");
  }
  void begin(const bench::OptionProblem& problem) { problem_ = &problem; }

  /// run() gives value and standard error.
  template <class Run>
  void row(const std::string& method, std::size_t steps, std::size_t size, Run run) {
    const double start = processor_seconds();
    const MonteCarloResult r = run();
    const double seconds = processor_seconds() - start;
    const double error = std::hypot(r.value - problem_->exact, r.standard_error);
    fmt::print("| {} | {} | {} | {} | {:.8g} | {:.1e} | {:.3g} |\n", problem_->name, method, steps, size,
               r.value, error, seconds);
    std::fflush(stdout);
    if (csv_ != nullptr)
      fmt::print(csv_, "{},{},{},{},{:.6g},{:.6g}\n", problem_->name, method, steps, size, error, seconds);
  }

 private:
  const bench::OptionProblem* problem_ = nullptr;
  std::FILE* csv_;
};

const ThinningOptions recombination = {ThinningMethod::recombination, SiteOrder::spatial, 0};

void run_rivals(const bench::OptionProblem& problem, Table& table) {
#ifdef WIENERTREE_QUANTLIB
  const bench::HestonCall call;
  if (problem.name == "call") {
    for (const auto& [steps, paths] : Sizes{{10, 10'000}, {10, 100'000}, {20, 400'000}})
      table.row("QuantLib Monte Carlo", steps, paths,
                [&] { return bench::quantlib_heston(call, steps, paths, 1); });
    for (const auto& [steps, paths] : Sizes{{10, 16'383}, {20, 131'071}, {40, 524'287}})
      table.row("QuantLib Sobol", steps, paths,
                [&] { return bench::quantlib_heston_sobol(call, steps, paths); });
  }
  if (problem.name == "call" || problem.name == "digital")
    for (const std::size_t n : {12U, 25U, 50U, 100U, 200U})
      table.row("QuantLib finite differences", n, 4 * n * n, [&] {
        return problem.name == "call" ? bench::quantlib_heston_fd(call, n, 4 * n, n)
                                      : bench::quantlib_heston_digital_fd(call, n, 4 * n, n);
      });
  if (problem.name == "basket")
    for (const std::size_t paths : {4'095U, 32'767U, 262'143U, 2'097'151U})
      table.row("QuantLib Sobol", 1, paths, [&] { return bench::quantlib_basket_sobol(paths); });
#endif
  const BatchFunction payoff = problem.model.compile(problem.payoff, "payoff");
  for (const auto& [steps, paths] : Sizes{{10, 10'000}, {50, 100'000}, {200, 1'000'000}})
    table.row("Euler Monte Carlo", steps, paths, [&] {
      return euler_monte_carlo(problem.model.model(), payoff, problem.horizon, steps, paths);
    });
}

void run_trees(const bench::OptionProblem& problem, Table& table) {
  const Model& model = problem.model.model();
  const KinkedFunction payoff = problem.model.compile_kinked(problem.payoff, "payoff");
  const CubatureFormula five = construct(5, static_cast<int>(model.noise_dimension()));
  const auto tree = [&](const std::string& method, std::size_t steps, std::size_t N, ThinningOptions thinning,
                        std::uint32_t launches, bool richardson) {
    table.row(method, steps, N, [&] {
      WeakRun run;
      run.options.formula = five;
      run.options.nodes = N;
      run.options.thinning = thinning;
      run.options.finest_along = payoff.kinks.front();
      run.horizon = problem.horizon;
      run.steps = steps;
      run.launches = launches;
      run.richardson = richardson;
      const WeakPayoff averaged =
          launches > 1 ? WeakPayoff(payoff.exact) : WeakPayoff(payoff);  // sampled: as it is
      const WeakResult r = run_weak(model, {averaged}, run);
      return richardson ? MonteCarloResult{r.extrapolated[0], r.extrapolated_standard_error[0]}
                        : MonteCarloResult{r.value[0], r.standard_error[0]};
    });
  };
  if (problem.name == "call") {
    for (const auto& [steps, N] : Sizes{{5, 1'000}, {10, 10'000}, {20, 100'000}})
      tree("sampled tree", steps, N, {ThinningMethod::tbba, SiteOrder::tree, 0}, 10, false);
    for (const auto& [steps, N] : Sizes{{5, 1'000}, {10, 10'000}, {20, 50'000}})
      tree("TBBA in spatial order", steps, N, {ThinningMethod::tbba, SiteOrder::spatial, 0}, 4, false);
  }
  const Sizes recombined = model.state_dimension() == 2
                               ? Sizes{{4, 300}, {8, 600}, {16, 1'200}, {32, 2'400}, {64, 4'800}}
                               : Sizes{{4, 800}, {8, 1'600}, {16, 3'200}, {32, 6'400}};
  for (const auto& [steps, N] : recombined) tree("recombined tree", steps, N, recombination, 1, false);
  for (const auto& [steps, N] : recombined)
    tree("recombined tree, extrapolated", steps, N, recombination, 1, true);
}

// The model as it is written: its variance moves by the exact transition, its price is integrated out.
void run_exact_transition(const bench::OptionProblem& problem, Table& table) {
  const TextModel moved = problem.model.without_price();
  const ConditionalPrice price(*problem.model.square_roots(), problem.model.model().initial);
  const BatchFunction smooth =
      price.average_of_rest(problem.model.compile(problem.payoff, "payoff"),
                            {problem.model.compile(problem.kink, "kink")}, problem.horizon);
  for (const auto& [steps, N] : Sizes{{2, 64}, {3, 64}, {4, 64}, {6, 128}, {8, 200}, {16, 400}, {32, 1'000}})
    table.row("exact transition", steps, N, [&] {
      WeakRun run;
      run.options.formula = construct(5, 2);  // only its degree has a meaning: rules of four nodes
      run.options.formula.degree = 7;
      run.options.transition = std::make_shared<SquareRootTransition>(*moved.square_roots());
      run.options.nodes = N;
      run.options.thinning = recombination;
      run.horizon = problem.horizon;
      run.steps = steps;
      WeakPayoff averaged(smooth);
      averaged.at_times = {smooth};  // over the nodes that thinning leaves
      return MonteCarloResult{run_weak(moved.model(), {averaged}, run).value[0], 0};
    });
}

}  // namespace

int main(int argc, char** argv) {
  std::FILE* csv = argc > 1 ? std::fopen(argv[1], "w") : nullptr;
  if (argc > 1 && csv == nullptr) {
    fmt::print(stderr, "{} cannot be written\n", argv[1]);
    return 1;
  }
#ifndef WIENERTREE_QUANTLIB
  fmt::print(stderr, "built without QuantLib (Debian: libquantlib0-dev): its rows are left out\n");
#endif
  Table table(csv);
  for (const bench::OptionProblem& problem : bench::option_problems()) {
    fmt::print(stderr, "{}: exact {:.10g}\n", problem.name, problem.exact);
    table.begin(problem);
    run_rivals(problem, table);
    run_trees(problem, table);
    if (problem.model.square_roots() && problem.model.square_roots()->price)
      run_exact_transition(problem, table);
  }
  if (csv != nullptr && std::fclose(csv) != 0) {
    fmt::print(stderr, "{} cannot be written\n", argv[1]);
    return 1;
  }
}
