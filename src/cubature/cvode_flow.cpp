#include <algorithm>

#include "wienertree/cubature/cvode_block.hpp"
#include "wienertree/cubature/flow_methods.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {
namespace {

/// Blocks of flow_block nodes are systems of their own: the nodes of a block move at the pace of the worst of
/// them, and no further.
class CvodeFlow final : public Flow {
 public:
  CvodeFlow(const Model& model, FlowTolerance tolerance)
      : tolerance_(tolerance), field_(model), block_(field_, tolerance), whole_(flow_block, 1.0) {}

  void move(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures) override {
    const std::size_t failed_before = failures.size();
    const std::uint64_t evaluations_before = block_.evaluations();
    for (std::size_t first = 0; first < x.nodes(); first += flow_block) {
      const std::size_t count = std::min(flow_block, x.nodes() - first), known = failures.size();
      block_.move(D, {whole_.data(), count}, x.nodes(first, count), failures);
      for (std::size_t f = known; f < failures.size(); ++f) failures[f].node += first;
    }
    field_.enforce_bounds(x, failures);
    sort_failures(failures, failed_before);
    statistics_.node_segments += x.nodes();
    statistics_.cvode_nodes += x.nodes();
    statistics_.field_evaluations += block_.evaluations() - evaluations_before;
  }

  std::unique_ptr<Flow> clone() const override { return make_cvode_flow(field_.model(), tolerance_); }
  std::string_view name() const override { return "cvode"; }

 private:
  FlowTolerance tolerance_;
  SegmentField field_;
  CvodeBlock block_;
  std::vector<double> whole_;
};

}  // namespace

std::unique_ptr<Flow> make_cvode_flow(const Model& model, FlowTolerance tolerance) {
  return std::make_unique<CvodeFlow>(model, tolerance);
}

}  // namespace wienertree
