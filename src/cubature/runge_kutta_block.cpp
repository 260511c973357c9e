#include "wienertree/cubature/runge_kutta_block.hpp"

#include <cassert>

namespace wienertree {
namespace {

constexpr std::size_t max_stages = 13;

}  // namespace

RungeKuttaBlock::RungeKuttaBlock(std::size_t dimension, FlowTolerance tolerance)
    : kernel_(runge_kutta_kernels().back()), dimension_(dimension), tolerance_(tolerance) {
  constexpr std::size_t octets = lanes / 8;
  for (Octets* block : {&states_, &arguments_, &results_}) block->resize(dimension * octets);
  for (Octets* row : {&step_sizes_, &squared_errors_}) row->resize(octets);
  stages_.resize(max_stages * dimension * octets);
}

RungeKuttaBlock::Method::Method(const RungeKuttaPair& pair, RungeKuttaBlock& block)
    : pair_(&pair), begins_{0} {
  assert(static_cast<std::size_t>(pair.stages) <= max_stages);
  const auto append = [&](std::span<const double> coefficients) {
    for (std::size_t j = 0; j < coefficients.size(); ++j)
      if (coefficients[j] != 0.0) terms_.push_back({block.stage(j), coefficients[j]});
    begins_.push_back(terms_.size());
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(pair.stages); ++i) append(pair.row(i));
  append(pair.b);
  append(pair.e);
  append(pair.g);
}

void RungeKuttaBlock::attempt(const Method& method, SegmentField& field, std::span<const double> D,
                              std::size_t n) {
  assert(n <= lanes);
  // The kernel computes whole groups of 16 lanes; what it makes of the lanes beyond n is never read.
  const LaneShape shape{dimension_, lanes, (n + 15) / 16 * 16};
  const auto stages = static_cast<std::size_t>(method.pair().stages);
  const double* x = states_.front().value;
  const double* h = step_sizes_.front().value;

  field.evaluate(states(n), D, {stage(0), dimension_, n, lanes});
  for (std::size_t i = 1; i < stages; ++i) {
    kernel_.combine(shape, x, h, method.row(i), arguments_.front().value);
    field.evaluate(view(arguments_, n), D, {stage(i), dimension_, n, lanes});
  }
  const StepTerms terms{method.row(stages), method.row(stages + 1),    method.row(stages + 2),
                        stage(0),           method.pair().guard_power, method.pair().guard_weight};
  kernel_.finish(shape, x, h, terms, tolerance_, results_.front().value, squared_errors_.front().value);
}

}  // namespace wienertree
