#pragma once
/// A block of nodes moved by CVODE, in which a node that fails does not take the others with it.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {

class CvodeIntegrator;

/// One instance belongs to one thread.
class CvodeBlock {
 public:
  /// `field` must outlive the instance.
  /// @throws RunError if SUNDIALS cannot be set up
  CvodeBlock(SegmentField& field, FlowTolerance tolerance);
  ~CvodeBlock();
  CvodeBlock(const CvodeBlock&) = delete;
  CvodeBlock& operator=(const CvodeBlock&) = delete;

  /// Moves node n in place along the share `lengths[n]` in (0, 1] of segment D. x: d x N, N <= flow_block.
  /// Nodes that fail are appended to `failures`, numbered within x, and become NaN (left_bounds:
  /// stay where the integration stopped). The others move exactly as if the failed ones were not there.
  void move(std::span<const double> D, std::span<const double> lengths, BatchView x,
            std::vector<NodeFailure>& failures);

  /// Nodes x evaluations of the field since construction.
  std::uint64_t evaluations() const;

 private:
  bool solve(std::span<const std::size_t> nodes, BatchView x);
  void settle(std::span<const std::size_t> nodes, BatchView x, std::vector<NodeFailure>& failures);

  std::unique_ptr<CvodeIntegrator> integrator_;
  Batch start_;
  std::span<const double> D_, lengths_;          // of the current call
  std::vector<std::size_t> finite_, survivors_;  // nodes
};

}  // namespace wienertree
