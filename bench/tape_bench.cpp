// Cost of an expression on the tape, in ns per value (an output of a node), by each machine code of this
// processor.
//
//   bench_tape --benchmark_filter='tanh'
//
// Nodes are evaluated in calls of `tape_block` and of 100 000 nodes: the flow of a node evaluates the fields
// block by block, an Euler filter a whole generation at once.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <string>

#include "wienertree/model/tape.hpp"

namespace {

using wienertree::Op;
using wienertree::Tape;
using wienertree::TapeBuilder;
using wienertree::TapeKernel;
using Value = TapeBuilder::Value;

struct Problem {
  const char* name;
  Tape tape;
  std::vector<double> uniforms;
};

/// ((((x/5 + 1) x - 1/2) x + 2) x - 3) x + 1/7
Tape polynomial() {
  TapeBuilder t(1, 0);
  const Value x = t.input(0);
  Value sum = t.constant(0.2);
  for (const double c : {1.0, -0.5, 2.0, -3.0, 1.0 / 7})
    sum = t.binary(Op::add, t.binary(Op::multiply, sum, x), t.constant(c));
  return t.finish({&sum, 1});
}

/// tanh(x/2) and its derivative (1 - tanh(x/2)^2)/2
Tape tanh_and_derivative() {
  TapeBuilder t(1, 0);
  const Value half = t.constant(0.5),
              y = t.unary(Op::hyperbolic_tangent, t.binary(Op::multiply, half, t.input(0)));
  const Value square = t.binary(Op::power, y, t.constant(2));
  const Value outputs[] = {y, t.binary(Op::multiply, half, t.binary(Op::subtract, t.constant(1), square))};
  return t.finish(outputs);
}

/// sum_k V_k D_k of Heston's model in Stratonovich form, with r, kappa, theta, xi, rho, D_0, D_1, D_2 uniform:
///   ds = (r - v/2 - rho xi/4) s dt + sqrt(v) s o dB^1
///   dv = (kappa (theta - v) - xi^2/4) dt + xi sqrt(v) o (rho dB^1 + sqrt(1 - rho^2) dB^2)
Tape heston() {
  TapeBuilder t(2, 8);
  const auto add = [&](Value a, Value b) { return t.binary(Op::add, a, b); };
  const auto minus = [&](Value a, Value b) { return t.binary(Op::subtract, a, b); };
  const auto times = [&](Value a, Value b) { return t.binary(Op::multiply, a, b); };
  const Value s = t.input(0), v = t.input(1), root = t.unary(Op::square_root, v), quarter = t.constant(0.25);
  const Value r = t.uniform(0), kappa = t.uniform(1), theta = t.uniform(2), xi = t.uniform(3),
              rho = t.uniform(4);
  const Value D0 = t.uniform(5), D1 = t.uniform(6), D2 = t.uniform(7);
  const Value s0 = times(minus(minus(r, times(t.constant(0.5), v)), times(quarter, times(rho, xi))), s);
  const Value v0 = minus(times(kappa, minus(theta, v)), times(quarter, times(xi, xi)));
  const Value v2 = times(times(xi, t.unary(Op::square_root, minus(t.constant(1), times(rho, rho)))), root);
  const Value outputs[] = {add(times(s0, D0), times(times(root, s), D1)),
                           add(add(times(v0, D0), times(times(times(rho, xi), root), D1)), times(v2, D2))};
  return t.finish(outputs);
}

void run(benchmark::State& state, const Problem& problem, const TapeKernel& kernel) {
  const auto nodes = static_cast<std::size_t>(state.range(0));
  const std::size_t I = problem.tape.inputs(), O = problem.tape.outputs();
  std::vector<double> x(I * nodes), y(O * nodes);
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(0.1, 4.0);
  for (double& value : x) value = uniform(generator);
  std::vector<const double*> inputs;
  std::vector<double*> outputs;
  for (std::size_t i = 0; i < I; ++i) inputs.push_back(x.data() + i * nodes);
  for (std::size_t o = 0; o < O; ++o) outputs.push_back(y.data() + o * nodes);
  for (auto _ : state) {
    problem.tape.evaluate(kernel, inputs, problem.uniforms, outputs, nodes);
    benchmark::DoNotOptimize(y.data());
    benchmark::ClobberMemory();
  }
  const double values = static_cast<double>(state.iterations()) * static_cast<double>(nodes);
  state.counters["ns/node"] =
      benchmark::Counter(values * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["ns/value"] = benchmark::Counter(values * static_cast<double>(O) * 1e-9,
                                                  benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["instructions"] = static_cast<double>(problem.tape.instructions());
  state.counters["registers"] = static_cast<double>(problem.tape.registers());
}

}  // namespace

int main(int argc, char** argv) {
  const Problem problems[] = {{"polynomial", polynomial(), {}},
                              {"tanh", tanh_and_derivative(), {}},
                              {"heston", heston(), {0.05, 2.0, 0.09, 0.1, -0.3, 0.1, 0.3, -0.2}}};
  const wienertree::TapeKernels kernels = wienertree::tape_kernels();
  for (const Problem& problem : problems)
    for (std::size_t k = 0; k < kernels.count; ++k)
      benchmark::RegisterBenchmark((std::string(problem.name) + "/" + kernels.kernels[k].name).c_str(), run,
                                   problem, kernels.kernels[k])
          ->Arg(static_cast<int>(wienertree::tape_block))
          ->Arg(100000);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
