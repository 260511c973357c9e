// Cost of thinning, in ns a site (lower figures are better): M sites, three sorted branches of M/3 parents,
// thinned to M/3 particles.
//
//   draws/*                     random numbers, ns each
//   masses                      normalisation of the log-weights alone
//   counts/METHOD               counts alone, from given masses
//   order/d=D/{runs,shuffled}   spatial order alone
//   thin/METHOD/{tree,spatial}  the whole call of Thinning::thin, d = 1
//
//   bench_thinning --benchmark_min_time=0.2
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "wienertree/thinning/masses.hpp"
#include "wienertree/thinning/resampling.hpp"
#include "wienertree/thinning/site_order.hpp"
#include "wienertree/thinning/tbba.hpp"
#include "wienertree/thinning/thinning.hpp"

namespace {

using namespace wienertree;

constexpr std::size_t branches = 3;

struct Measure {
  std::size_t parents;
  Batch x;
  std::vector<double> log_weight;
  Measure(std::size_t sites, std::size_t d, bool sorted)
      : parents(sites / branches), x(d, parents * branches), log_weight(parents * branches) {
    for (std::size_t i = 0; i < d; ++i)
      RandomStream{1, 0, static_cast<std::uint32_t>(i)}.normals(0, x.component(i));
    for (std::size_t b = 0; sorted && b < branches; ++b) {
      const auto branch = x.component(0).subspan(b * parents, parents);
      std::sort(branch.begin(), branch.end());
    }
    for (std::size_t i = 0; i < log_weight.size(); ++i) log_weight[i] = -0.5 * std::pow(x(0, i) - 0.7, 2);
  }
  std::size_t size() const { return log_weight.size(); }
  operator Sites() const { return {x, log_weight, parents}; }
};

void per_item(benchmark::State& state, std::size_t items) {
  state.counters["each"] =
      benchmark::Counter(static_cast<double>(items),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void draws(benchmark::State& state, void (RandomStream::*fill)(std::uint64_t, std::span<double>) const) {
  std::vector<double> out(4096);
  for (auto _ : state) {
    (RandomStream{1}.*fill)(0, out);
    benchmark::DoNotOptimize(out.data());
  }
  per_item(state, out.size());
}

void masses(benchmark::State& state) {
  const Measure m(static_cast<std::size_t>(state.range(0)), 1, true);
  ParticleMasses out;
  for (auto _ : state) assign_masses(m.log_weight, m.parents, out);
  per_item(state, m.size());
}

using CountLaw = void (*)(std::span<const std::uint64_t>, int, const RandomStream&, std::span<std::uint32_t>);

void tbba_counts(std::span<const std::uint64_t> mass, int bits, const RandomStream& random,
                 std::span<std::uint32_t> count) {
  TbbaRemainder all{mass.size() / branches << bits, false};
  tbba(mass, bits, random, 0, all, count);
}

void counts(benchmark::State& state, CountLaw law) {
  const Measure m(static_cast<std::size_t>(state.range(0)), 1, true);
  ParticleMasses masses;
  assign_masses(m.log_weight, m.parents, masses);
  std::vector<std::uint32_t> count(m.size());
  for (auto _ : state) {
    law(masses.mass, masses.fraction_bits, {1}, count);
    benchmark::DoNotOptimize(count.data());
  }
  per_item(state, m.size());
}

void order(benchmark::State& state, std::size_t d, bool sorted) {
  const Measure m(static_cast<std::size_t>(state.range(0)), d, sorted);
  ParticleMasses masses;
  assign_masses(m.log_weight, m.parents, masses);
  SiteOrdering ordering;
  Buffer<std::uint32_t> visit;
  for (auto _ : state) ordering.spatial(m, masses, visit);
  per_item(state, m.size());
}

void thin(benchmark::State& state, ThinningMethod method, SiteOrder order_of) {
  const Measure m(static_cast<std::size_t>(state.range(0)), 1, true);
  const auto thinning = make_thinning({method, order_of});
  Selection out;
  for (auto _ : state) thinning->thin(m, m.parents, {1}, out);
  per_item(state, m.size());
}

void sizes(benchmark::internal::Benchmark* b) { b->Arg(10000)->Arg(1000000)->Unit(benchmark::kMicrosecond); }

}  // namespace

int main(int argc, char** argv) {
  using benchmark::RegisterBenchmark;
  RegisterBenchmark("draws/uniform", draws, &RandomStream::uniforms);
  RegisterBenchmark("draws/normal", draws, &RandomStream::normals);
  RegisterBenchmark("draws/exponential", draws, &RandomStream::exponentials);
  sizes(RegisterBenchmark("masses", masses));
  const std::pair<const char*, CountLaw> laws[] = {{"tbba", tbba_counts},
                                                   {"systematic", systematic_counts},
                                                   {"stratified", stratified_counts},
                                                   {"residual", residual_counts},
                                                   {"multinomial", multinomial_counts}};
  for (const auto& [name, law] : laws)
    sizes(RegisterBenchmark(("counts/" + std::string(name)).c_str(), counts, law));
  for (const std::size_t d : {1U, 2U, 3U, 6U})
    for (const bool sorted : {true, false})
      if (d == 1 || !sorted)
        sizes(RegisterBenchmark(("order/d=" + std::to_string(d) + (sorted ? "/runs" : "/shuffled")).c_str(),
                                order, d, sorted));
  for (const ThinningMethod method :
       {ThinningMethod::tbba, ThinningMethod::systematic, ThinningMethod::stratified,
        ThinningMethod::residual, ThinningMethod::multinomial})
    for (const SiteOrder order_of : {SiteOrder::tree, SiteOrder::spatial}) {
      const std::string name(make_thinning({method, order_of})->name());
      sizes(RegisterBenchmark(("thin/" + name + (order_of == SiteOrder::tree ? "/tree" : "/spatial")).c_str(),
                              thin, method, order_of));
    }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
