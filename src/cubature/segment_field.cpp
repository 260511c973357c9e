#include "wienertree/cubature/segment_field.hpp"

#include <algorithm>

namespace wienertree {

SegmentField::SegmentField(const Model& model) : model_(&model) {
  for (std::size_t i = 0; i < model.bounds.size(); ++i) {
    if (!model.bounds[i].bounded()) continue;
    bounded_.push_back(i);
    if (model.bounds[i].boundary != Boundary::error) restricted_.push_back(i);
  }
}

ConstBatchView SegmentField::inside(ConstBatchView x) {
  inside_.reshape(x.components(), x.nodes());
  for (std::size_t i = 0; i < x.components(); ++i)
    std::copy_n(x.component(i).data(), x.nodes(), inside_.component(i).data());
  for (const std::size_t i : restricted_) {
    const StateBound& bound = model_->bounds[i];
    for (double& value : inside_.component(i)) {
      if (value < bound.lower) value = bound.lower;
      if (value > bound.upper) value = bound.upper;
    }
  }
  return inside_.view();
}

void SegmentField::evaluate(ConstBatchView x, std::span<const double> D, BatchView out) {
  if (restricted_.empty()) {
    model_->fields->direct(x, D, out);
    return;
  }
  model_->fields->direct(inside(x), D, out);
  for (const std::size_t i : restricted_) {
    const StateBound& bound = model_->bounds[i];
    if (bound.boundary != Boundary::absorb) continue;
    for (std::size_t n = 0; n < x.nodes(); ++n)
      if (x(i, n) == bound.lower || x(i, n) == bound.upper) out(i, n) = 0.0;
  }
}

void SegmentField::jacobian(ConstBatchView x, std::span<const double> D, BatchView out) {
  if (restricted_.empty()) {
    model_->fields->jacobian(x, D, out);
    return;
  }
  model_->fields->jacobian(inside(x), D, out);
  const std::size_t d = dimension();
  for (const std::size_t i : restricted_) {
    const StateBound& bound = model_->bounds[i];
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      if (x(i, n) > bound.lower && x(i, n) < bound.upper) continue;
      // Nothing depends on x_i beyond its bound. On the bound the derivative of a square root is infinite;
      // the flow that starts there moves inward or not at all, and Newton's iteration converges without that
      // column.
      for (std::size_t j = 0; j < d; ++j) out(j * d + i, n) = 0.0;
      if (bound.boundary == Boundary::absorb && (x(i, n) == bound.lower || x(i, n) == bound.upper))
        for (std::size_t l = 0; l < d; ++l) out(i * d + l, n) = 0.0;
    }
  }
}

std::size_t SegmentField::outside(ConstBatchView x, std::size_t node) const {
  for (const std::size_t i : bounded_)
    if (x(i, node) < model_->bounds[i].lower || x(i, node) > model_->bounds[i].upper) return i;
  return dimension();
}

void SegmentField::enforce_bounds(BatchView x, std::vector<NodeFailure>& failures) const {
  for (const std::size_t i : bounded_) {
    const StateBound& bound = model_->bounds[i];
    for (std::size_t n = 0; n < x.nodes(); ++n) {
      double& value = x(i, n);
      if (!(value < bound.lower || value > bound.upper)) continue;
      if (bound.boundary == Boundary::error)
        failures.push_back({n, i, value, FailureReason::left_bounds});
      else
        value = std::clamp(value, bound.lower, bound.upper);
    }
  }
}

}  // namespace wienertree
