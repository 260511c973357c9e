#pragma once
/// The nodes an explicit method gave up on, and CVODE for the rest of their segment.
#include <memory>
#include <span>
#include <vector>

#include "wienertree/cubature/cvode_block.hpp"
#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {

/// CVODE's memory is made when the first stiff node is moved.
class StiffNodes {
 public:
  /// `field` must outlive the instance.
  StiffNodes(SegmentField& field, FlowTolerance tolerance) : field_(field), tolerance_(tolerance) {}

  /// Node `node` has reached u = 1 - rest, and is in this state (d values).
  void add(std::size_t node, double rest, std::span<const double> state);
  /// Moves every node added to the end of the segment D, writes it to x, and forgets it. Nodes of the same
  /// block of flow_block move together; failures are appended.
  void finish(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures,
              FlowStatistics& statistics);

 private:
  struct Entry {
    std::size_t node, state;  // state: index in states_
    double rest;
  };
  SegmentField& field_;
  FlowTolerance tolerance_;
  std::vector<Entry> entries_;
  std::vector<double> states_, rests_;
  Batch block_;
  std::unique_ptr<CvodeBlock> cvode_;
};

}  // namespace wienertree
