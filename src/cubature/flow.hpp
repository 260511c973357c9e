#pragma once
/// Seam 2: moving a batch of nodes along a segment.
///
/// Along a segment with increments D = (D_0..D_p) each node solves dx/du = sum_k V_k(x) D_k, u in [0,1]. The
/// flow along a path is the composition over its segments.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

enum class FlowMethod {
  automatic,  ///< exact when the model has a closed form, else explicit
  exact,
  explicit_,  ///< embedded Runge-Kutta pair over blocks, error estimate per node; nodes over tolerance go to
              ///< CVODE
  cvode,      ///< CVODE over a batch with a max-over-nodes norm
};

/// Local error per segment of component i is kept below absolute + relative |x_i|, for every node.
struct FlowTolerance {
  double relative = 1e-8, absolute = 1e-10;
};

enum class FailureReason { not_finite, tolerance_not_reached, left_bounds };

/// A node that could not be moved. Its state after the call is NaN, except for left_bounds, where it is kept.
struct NodeFailure {
  std::size_t node = 0;   ///< index in the batch handed over
  std::size_t state = 0;  ///< component at fault
  double value = 0;       ///< its last value
  FailureReason reason = FailureReason::not_finite;
  std::string message = {};  ///< the solver's own words, empty when it had none
};

/// Work done since construction.
struct FlowStatistics {
  std::uint64_t node_segments = 0;      ///< nodes x segments moved
  std::uint64_t field_evaluations = 0;  ///< nodes x evaluations of sum_k V_k D_k
  std::uint64_t cvode_nodes = 0;        ///< node-segments handed to CVODE
  FlowStatistics& operator+=(const FlowStatistics& other);
};

/// An instance belongs to one thread and reuses its scratch; `clone` makes one for another thread. What
/// happens to a node depends on the nodes of its block of `flow_block` at most, and blocks are cut from the
/// start of the batch: results do not depend on the number of threads as long as batches are split at
/// multiples of `flow_block`.
class Flow {
 public:
  virtual ~Flow() = default;
  /// Moves every node along one segment, in place, and enforces the model's bounds at its end. D: 1+p values,
  /// x: d x N. Nodes that fail are appended to `failures`; the others are moved all the same.
  virtual void move(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures) = 0;
  virtual std::unique_ptr<Flow> clone() const = 0;
  virtual std::string_view name() const = 0;
  const FlowStatistics& statistics() const { return statistics_; }

  /// Moves every node along all segments of a path scaled to a step of length s.
  void move_along(const CubaturePath& path, double s, BatchView x, std::vector<NodeFailure>& failures);

 protected:
  FlowStatistics statistics_;

 private:
  std::vector<double> increments_;
};

inline constexpr std::size_t flow_block = 64;

/// The model is kept by reference and must outlive the flow. `degree` is the formula's m, from which
/// `explicit_` chooses its order.
/// @throws InputError if `exact` is asked of a model without closed form, or a tolerance is not positive
std::unique_ptr<Flow> make_flow(FlowMethod method, const Model& model, FlowTolerance tolerance, int degree);
std::unique_ptr<Flow> make_flow(FlowMethod method, const Model&& model, FlowTolerance tolerance,
                                int degree) = delete;

}  // namespace wienertree
