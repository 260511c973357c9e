#pragma once
/// One step of an embedded Runge-Kutta pair for a block of nodes at once, each with a step size of its own.
#include <span>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/runge_kutta_kernel.hpp"
#include "wienertree/cubature/runge_kutta_pairs.hpp"
#include "wienertree/cubature/segment_field.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Scratch and kernels. Lanes never mix: what a step returns for a lane depends on that lane's state and step
/// size alone, bit for bit, provided that the vector fields keep the same promise.
class RungeKuttaBlock {
 public:
  static constexpr std::size_t lanes = 128;

  RungeKuttaBlock(std::size_t dimension, FlowTolerance tolerance);
  RungeKuttaBlock(const RungeKuttaBlock&) = delete;
  RungeKuttaBlock& operator=(const RungeKuttaBlock&) = delete;

  /// A pair made ready for this block: its nonzero coefficients with the stages they multiply.
  class Method {
   public:
    Method(const RungeKuttaPair& pair, RungeKuttaBlock& block);
    const RungeKuttaPair& pair() const { return *pair_; }

   private:
    friend class RungeKuttaBlock;
    std::span<const StageTerm> row(std::size_t i) const {
      return {terms_.data() + begins_[i], begins_[i + 1] - begins_[i]};
    }
    const RungeKuttaPair* pair_;
    std::vector<StageTerm> terms_;
    std::vector<std::size_t> begins_;  // rows 0 .. s-1 of a, then b, e, g
  };

  /// Input, to be filled by the caller: states (d x n) and step sizes in u (n), n <= lanes.
  BatchView states(std::size_t n) { return view(states_, n); }
  std::span<double> step_sizes(std::size_t n) { return {step_sizes_.front().value, n}; }

  /// Advances every lane by its step. After it, `results(n)` are the new states and `squared_errors(n)` the
  /// squares of the estimated errors per unit of u, in units of the tolerance absolute + relative max(|x_i|,
  /// |result_i|) and for the worst component; NaN where a stage or the result was not finite.
  void attempt(const Method& method, SegmentField& field, std::span<const double> D, std::size_t n);

  ConstBatchView results(std::size_t n) const { return {results_.front().value, dimension_, n, lanes}; }
  std::span<const double> squared_errors(std::size_t n) const { return {squared_errors_.front().value, n}; }

 private:
  /// Eight lanes, aligned as the widest SIMD register.
  struct alignas(64) Octet {
    double value[8];
  };
  using Octets = std::vector<Octet>;
  BatchView view(Octets& octets, std::size_t n) { return {octets.front().value, dimension_, n, lanes}; }
  double* stage(std::size_t i) { return stages_.front().value + i * dimension_ * lanes; }

  const RungeKuttaKernel& kernel_;
  std::size_t dimension_;
  FlowTolerance tolerance_;
  Octets states_, step_sizes_, arguments_, results_, squared_errors_, stages_;
};

}  // namespace wienertree
