#include "wienertree/cubature/cvode_block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "wienertree/cubature/cvode_integrator.hpp"
#include "wienertree/cubature/flow_methods.hpp"

namespace wienertree {

CvodeBlock::CvodeBlock(SegmentField& field, FlowTolerance tolerance)
    : integrator_(std::make_unique<CvodeIntegrator>(field, tolerance)),
      start_(field.dimension(), flow_block) {
  finite_.reserve(flow_block);
  survivors_.reserve(flow_block);
}

CvodeBlock::~CvodeBlock() = default;

std::uint64_t CvodeBlock::evaluations() const { return integrator_->evaluations(); }

void CvodeBlock::move(std::span<const double> D, std::span<const double> lengths, BatchView x,
                      std::vector<NodeFailure>& failures) {
  assert(lengths.size() == x.nodes());
  D_ = D;
  lengths_ = lengths;
  const std::size_t failed_before = failures.size();
  finite_.clear();
  survivors_.clear();
  for (std::size_t n = 0; n < x.nodes(); ++n) {
    if (fail_if_not_finite(x, n, failures)) continue;
    for (std::size_t i = 0; i < x.components(); ++i) start_(i, n) = x(i, n);
    finite_.push_back(n);
  }
  if (finite_.empty() || solve(finite_, x)) return;
  settle(finite_, x, failures);
  // The guilty are known; the others start again together. Should that fail, what `settle` found for them
  // holds.
  if (failures.size() > failed_before && !survivors_.empty()) solve(survivors_, x);
}

bool CvodeBlock::solve(std::span<const std::size_t> nodes, BatchView x) {
  const BatchView y = integrator_->prepare(nodes.size());
  const std::span<double> lengths = integrator_->lengths();
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    lengths[n] = lengths_[nodes[n]];
    for (std::size_t i = 0; i < x.components(); ++i) y(i, n) = start_(i, nodes[n]);
  }
  if (!integrator_->solve(D_)) return false;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (std::size_t i = 0; i < x.components(); ++i) x(i, nodes[n]) = y(i, n);
  return true;
}

void CvodeBlock::settle(std::span<const std::size_t> nodes, BatchView x, std::vector<NodeFailure>& failures) {
  if (nodes.size() == 1) {
    const std::size_t node = nodes.front();
    if (solve(nodes, x)) {
      survivors_.push_back(node);
      return;
    }
    NodeFailure failure = integrator_->failure();
    failure.node = node;
    const ConstBatchView last = integrator_->states();
    for (std::size_t i = 0; i < x.components(); ++i)
      x(i, node) = failure.reason == FailureReason::left_bounds ? last(i, 0)
                                                                : std::numeric_limits<double>::quiet_NaN();
    failures.push_back(std::move(failure));
    return;
  }
  const std::size_t half = nodes.size() / 2;
  for (const auto part : {nodes.first(half), nodes.subspan(half)}) {
    if (part.size() > 1 && solve(part, x))
      survivors_.insert(survivors_.end(), part.begin(), part.end());
    else
      settle(part, x, failures);
  }
}

}  // namespace wienertree
