/// The strategies of thinning on the same trees: error against N and against processor time, d = 1, 2, 3.
///
///     build/bench/bench/thinning_study DIRECTORY      (about two minutes; bench/draw-thinning draws the table)
///
/// writes thinning.csv there. Filtering problems with T 5 in 20 steps, degree 5, second-order: Benes with mu
/// 0.05, sigma 1, h1 0.8 (d = 1), a noisy pendulum whose horizontal position is observed (d = 2, not linear),
/// the bundled linear-3d (d = 3). The error is that of thinning alone: root mean square over the components
/// of the posterior mean at T, and over 8 launches where thinning is random, of the difference from patched
/// recombination with 400, 4000 and 6000 nodes. What halving those nodes changes is printed: no error below
/// that is told.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/catalogue.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr const char* pendulum = R"TOML(
name = "pendulum"
convention = "ito"
[state]
angle = { initial = 1.0 }
speed = { initial = 0.0 }
[drift]
angle = "speed"
speed = "-2*sin(angle) - 0.4*speed"
[diffusion]
angle = ["0.2", "0"]
speed = ["0.1", "0.5"]
[observation]
kind = "continuous"
h = ["2*sin(angle)"]
)TOML";

struct Strategy {
  const char* name;
  ThinningMethod method;
  SiteOrder order = SiteOrder::spatial;
};

constexpr Strategy strategies[] = {{"tbba, tree order", ThinningMethod::tbba, SiteOrder::tree},
                                   {"multinomial", ThinningMethod::multinomial},
                                   {"residual", ThinningMethod::residual},
                                   {"stratified", ThinningMethod::stratified},
                                   {"systematic", ThinningMethod::systematic},
                                   {"tbba", ThinningMethod::tbba},
                                   {"levelwise", ThinningMethod::levelwise},
                                   {"heavy-first", ThinningMethod::heavy_first},
                                   {"recombination", ThinningMethod::recombination}};
constexpr Strategy patched = strategies[8];

struct Problem {
  Model model;
  ObservationPath path;
  std::vector<std::size_t> random, merged, whole;  ///< N of random methods, of those by patches, of levelwise
  std::size_t enough;

  struct Run {
    std::vector<double> means;
    double seconds;  ///< processor time of the steps
  };

  Run run_filter(const Strategy& s, std::size_t N, std::uint32_t launch) const {
    FilterOptions o;
    o.formula = find_formula(5, static_cast<int>(model.noise_dimension()),
                             WIENERTREE_SOURCE_DIR "/data/cubature_formulas");
    o.thinning = {s.method, s.order, 0};
    o.nodes = N;
    o.launch = launch;
    const auto filter = make_filter(model, o);
    const ObservationWindows windows(path, model.observation, model.timing, 20);
    const std::clock_t start = std::clock();
    run(*filter, windows, {});
    Run r{{}, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC};
    for (std::size_t i = 0; i < model.state_dimension(); ++i) r.means.push_back(mean(filter->posterior(), i));
    return r;
  }

  const std::vector<std::size_t>& budgets(const Strategy& s) const {
    return !recombines(s.method) ? random : s.method == ThinningMethod::levelwise ? whole : merged;
  }
};

double squared_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - b[i], 2);
  return sum;
}

void study(Problem p, std::FILE* csv) {
  p.path = simulate(p.model, 5.0, 100'000, 2'000, 2026).observations;
  const std::size_t d = p.model.state_dimension();
  const std::vector<double> truth = p.run_filter(patched, p.enough, 0).means;
  const double floor = std::sqrt(squared_distance(truth, p.run_filter(patched, p.enough / 2, 0).means) /
                                 static_cast<double>(d));
  fmt::print("d = {} ({}): {} nodes differ from {} by {:.1e}\n", d, p.model.name, p.enough, p.enough / 2,
             floor);
  for (const Strategy& s : strategies) {
    const std::uint32_t runs = 8;  // launches where thinning is random, repetitions of the same where not
    for (const std::size_t N : p.budgets(s)) {
      double squares = 0, seconds = INFINITY;
      for (std::uint32_t launch = 0; launch < runs; ++launch) {
        const Problem::Run r = p.run_filter(s, N, launch);
        squares += squared_distance(r.means, truth);
        seconds = std::min(seconds, r.seconds);
      }
      const double error = std::max(floor, std::sqrt(squares / static_cast<double>(runs * d)));
      const std::string line = fmt::format("{},{},{},{:.3g},{:.3g}\n", d, s.name, N, error, seconds);
      std::fputs(line.c_str(), csv);
      fmt::print("{}", line);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    fmt::print(stderr, "usage: thinning_study DIRECTORY\n");
    return 2;
  }
  const std::string file = std::string(arguments[1]) + "/thinning.csv";
  std::FILE* csv = std::fopen(file.c_str(), "w");
  if (csv == nullptr) {
    fmt::print(stderr, "{} cannot be written\n", file);
    return 1;
  }
  std::fputs("d,strategy,N,error,seconds\n", csv);
  study({bundled_model("benes"),
         {},
         {30, 100, 300, 1000, 3000, 10000},
         {4, 6, 10, 15, 30, 60},
         {4, 6, 10, 15, 30},
         400},
        csv);
  study({parse_model(pendulum, "pendulum.toml"),
         {},
         {100, 300, 1000, 3000, 10000},
         {15, 30, 60, 120, 240, 480, 960},
         {6, 10, 15, 28, 45, 66},
         4000},
        csv);
  study({bundled_model("linear-3d"),
         {},
         {100, 300, 1000, 3000, 10000},
         {20, 40, 80, 160, 320, 640, 1280},
         {10, 20, 35, 56, 84},
         6000},
        csv);
  std::fclose(csv);
}
