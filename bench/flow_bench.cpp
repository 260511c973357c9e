// Cost of moving one node along one segment to 1e-8, in ns, for the tanh drift (mu = 0.5, sigma = 0.8, nodes
// spread over N(0, 4)): the increments are (s, 1.7 sqrt(s)).
//
//   bench_flow --benchmark_min_time=0.2
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "tanh_fields.hpp"
#include "wienertree/cubature/flow.hpp"

namespace {

using namespace wienertree;

Model tanh_model() {
  Model model;
  model.name = "tanh";
  model.state_names = {"x"};
  model.initial = {0.0};
  model.bounds.resize(1);
  model.fields = std::make_shared<bench::TanhFields>(0.5, 0.8);
  return model;
}

/// `call`: nodes handed over at once.
void flow(benchmark::State& state, FlowMethod method, std::size_t nodes, std::size_t call, double s) {
  const Model model = tanh_model();
  const auto solver = make_flow(method, model, {}, 5);
  std::mt19937_64 random(1);
  std::normal_distribution<> normal(0.0, 2.0);
  Batch start(1, nodes), x(1, nodes);
  for (double& value : start.component(0)) value = normal(random);
  const double D[] = {s, 1.7 * std::sqrt(s)};
  std::vector<NodeFailure> failures;
  for (auto _ : state) {
    std::ranges::copy(start.component(0), x.component(0).begin());
    for (std::size_t first = 0; first < nodes; first += call)
      solver->move(D, x.view().nodes(first, std::min(call, nodes - first)), failures);
    benchmark::DoNotOptimize(x.component(0).data());
  }
  if (!failures.empty()) state.SkipWithError("a node failed");
  const FlowStatistics& statistics = solver->statistics();
  const auto segments = static_cast<double>(statistics.node_segments);
  state.counters["ns/node"] =
      benchmark::Counter(segments * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["evaluations"] = static_cast<double>(statistics.field_evaluations) / segments;
}

void register_all() {
  for (const double s : {0.001, 0.01, 0.03, 0.1, 0.3, 1.0}) {
    const auto name = [s](const char* what) {
      return std::string(what) + "/s=" + std::to_string(s).substr(0, 5);
    };
    benchmark::RegisterBenchmark(name("explicit").c_str(), flow, FlowMethod::explicit_, 10000, 10000, s);
    benchmark::RegisterBenchmark(name("explicit, 15 nodes a call").c_str(), flow, FlowMethod::explicit_,
                                 10000, 15, s);
    benchmark::RegisterBenchmark(name("cvode").c_str(), flow, FlowMethod::cvode, 10000, 10000, s);
    benchmark::RegisterBenchmark(name("cvode, 1 node a call").c_str(), flow, FlowMethod::cvode, 500, 1, s);
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  register_all();
  benchmark::RunSpecifiedBenchmarks();
}
