/// Recombination: time of one call, by number of sites, dimension, degree and budget.
///
///     build/bench/bench/bench_recombination --benchmark_filter=one_patch
///
/// The figure to compare with linear programming is `one_patch/10000`: 10^4 points of the plane to the 21
/// moments of degree at most 5 (an LP of 21 rows and 10^4 columns took CLP 57 ms and GLPK 43 ms on a like
/// machine).
#include <benchmark/benchmark.h>

#include <cmath>

#include "wienertree/thinning/recombination/recombination.hpp"

using namespace wienertree;

namespace {

struct Cloud {
  Batch x;
  std::vector<double> log_weight;
};

// Standard normal points with standard normal log-weights.
Cloud make_cloud(std::size_t d, std::size_t n) {
  Cloud c{Batch(d, n), std::vector<double>(n)};
  const RandomStream random{20240611};
  for (std::size_t i = 0; i < d; ++i) random.normals(i * n, c.x.component(i));
  random.normals(d * n, c.log_weight);
  return c;
}

void thin(benchmark::State& state, std::size_t d, std::size_t n, int degree, std::size_t budget) {
  const Cloud c = make_cloud(d, n);
  const auto thinning = make_recombination(degree);
  Selection out;
  for (auto _ : state) {
    thinning->thin({c.x.view(), c.log_weight, 0}, budget, {}, out);
    benchmark::DoNotOptimize(out.log_weight.data());
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(n));
  state.counters["kept"] = static_cast<double>(out.site.size());
}

void one_patch(benchmark::State& state) { thin(state, 2, static_cast<std::size_t>(state.range(0)), 5, 21); }
BENCHMARK(one_patch)->Arg(1000)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);

// As a filter calls it: children per kept node as in the formulas of degree 5 (3, 9, 25), degree chosen.
void filter_step(benchmark::State& state) {
  const auto d = static_cast<std::size_t>(state.range(0)), budget = static_cast<std::size_t>(state.range(1));
  thin(state, d, budget * (d == 1 ? 3 : d <= 3 ? 9 : 25), 0, budget);
}
BENCHMARK(filter_step)
    ->ArgNames({"d", "N"})
    ->ArgsProduct({{1}, {8, 15, 60, 1000, 100'000}})
    ->ArgsProduct({{2, 3}, {160, 640, 10'000}})
    ->ArgsProduct({{5}, {640}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
