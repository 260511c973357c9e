#pragma once
/// The right-hand side of a node's equation along a segment, dx/du = sum_k V_k(x) D_k, with the model's
/// bounds.
#include <span>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Where a component is bounded by `clamp` or `absorb`, the fields are evaluated at the nearest point inside.
/// Where it is bounded by `absorb` and lies on its bound, its own derivative is 0, so that it stays there
/// while the other components move on. `error` changes nothing until the end of the segment.
///
/// Holds scratch: one instance belongs to one thread.
class SegmentField {
 public:
  /// The model must outlive the instance.
  explicit SegmentField(const Model& model);

  std::size_t dimension() const { return model_->state_dimension(); }
  const Model& model() const { return *model_; }

  /// out(i, n) = dx_i/du at x_n.   x, out: d x N, not overlapping; D: 1+p values.
  void evaluate(ConstBatchView x, std::span<const double> D, BatchView out);
  /// out(i*d + l, n) = d/dx_l of the above.   out: d*d x N.
  void jacobian(ConstBatchView x, std::span<const double> D, BatchView out);

  /// The component of node n that lies outside its bound, or d when none does.
  std::size_t outside(ConstBatchView x, std::size_t node) const;

  /// The end of a segment: nodes outside a `clamp` or `absorb` bound are moved to it, nodes outside an
  /// `error` bound are reported and left where they are. NaN is left alone.   x: d x N.
  void enforce_bounds(BatchView x, std::vector<NodeFailure>& failures) const;

 private:
  ConstBatchView inside(ConstBatchView x);

  const Model* model_;
  std::vector<std::size_t> bounded_;     // components with a bound of any kind
  std::vector<std::size_t> restricted_;  // components with `clamp` or `absorb`
  Batch inside_;
};

}  // namespace wienertree
