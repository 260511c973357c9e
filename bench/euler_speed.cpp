/// Particle-steps per second of the Euler particle filter on a text model (Benes, mu 0.05, sigma 1, h1 0.8,
/// T 20), likelihood and resampling at every step included, beside a loop written by hand for that model.
///
///     build/bench/bench/euler_speed            (half a minute)
///
/// The parts alternate, and the best of several runs counts: a busy machine slows all of them.
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "hand_written_euler.hpp"
#include "papers/benes_problem.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr std::size_t steps = 200, repetitions = 9;

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <class Run>
double seconds(Run run) {
  const double start = processor_seconds();
  run();
  return processor_seconds() - start;
}

struct Row {
  std::string name;
  double best = INFINITY, mean = 0, log_evidence = 0;
};

}  // namespace

int main() {
  const BenesProblem problem("benes", 20.0, 1);
  const bench::TanhProblem numbers{0.05, 1, 0.8, 0};
  std::vector<double> increments;
  const ObservationWindows windows(problem.paths[0], problem.model.observation, problem.model.timing, steps);
  const std::size_t stride = (problem.paths[0].times.size() - 1) / steps;
  for (std::size_t j = 0; j < steps; ++j)
    increments.push_back(problem.paths[0].values[(j + 1) * stride] - problem.paths[0].values[j * stride]);

  BenesFilter exact(problem.model);
  run(exact, ObservationWindows(problem.paths[0], problem.model.observation, problem.model.timing, 0), {});
  fmt::print("exact: mean {:.4f}, log evidence {:.4f} (Euler on {} steps is biased by its step)\n\n",
             problem.exact[0], exact.posterior().log_evidence, steps);
  fmt::print(
      "| {:<28} | {:>7} | ns a particle-step | 1e6 particle-steps/s | of hand-written | mean | log evidence "
      "|\n"
      "|---|---|---|---|---|---|---|\n",
      "filter", "N");
  for (const std::size_t N : {10'000, 100'000}) {
    std::vector<Row> rows = {
        {"written by hand, systematic"}, {"text model, systematic"}, {"text model, TBBA"}};
    const auto general = [&](ThinningMethod method, Row& row) {
      FilterOptions o;
      o.method = FilterMethod::euler;
      o.functional = FunctionalMethod::picard;
      o.thinning = {method, SiteOrder::tree, 0};
      o.nodes = N;
      const auto filter = make_filter(problem.model, o);
      row.best = std::min(row.best, seconds([&] { run(*filter, windows, {}); }));
      row.mean = mean(filter->posterior(), 0);
      row.log_evidence = filter->posterior().log_evidence;
    };
    for (std::size_t r = 0; r < repetitions; ++r) {
      rows[0].best = std::min(rows[0].best, seconds([&] {
                                const auto result =
                                    bench::hand_written_euler(numbers, increments, 20.0 / steps, N, 1);
                                rows[0].mean = result.mean;
                                rows[0].log_evidence = result.log_evidence;
                              }));
      general(ThinningMethod::systematic, rows[1]);
      general(ThinningMethod::tbba, rows[2]);
    }
    for (const Row& row : rows) {
      const double each = row.best / static_cast<double>(N * steps);
      fmt::print("| {:<28} | {:>7} | {:.2f} | {:.0f} | {:.2f} | {:.4f} | {:.4f} |\n", row.name, N, 1e9 * each,
                 1e-6 / each, rows[0].best / row.best, row.mean, row.log_evidence);
    }
  }
}
