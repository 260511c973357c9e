#include <algorithm>

#include "wienertree/cubature/flow_methods.hpp"
#include "wienertree/cubature/segment_field.hpp"

namespace wienertree {
namespace {

/// The model's closed form. It knows nothing of bounds: those are enforced at the end of the segment.
class ExactFlow final : public Flow {
 public:
  explicit ExactFlow(const Model& model) : field_(model) {
    for (std::size_t i = 0; i < model.bounds.size(); ++i)
      if (model.bounds[i].bounded() && model.bounds[i].boundary == Boundary::absorb) absorbing_.push_back(i);
  }

  void move(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures) override {
    const std::size_t failed_before = failures.size();
    before_.reshape(absorbing_.size(), x.nodes());
    for (std::size_t i = 0; i < absorbing_.size(); ++i)
      std::ranges::copy(x.component(absorbing_[i]), before_.component(i).begin());
    field_.model().fields->exact_flow(D, x);
    for (std::size_t i = 0; i < absorbing_.size(); ++i) stay_on_bound(absorbing_[i], before_.component(i), x);
    field_.enforce_bounds(x, failures);
    double poison = 0;
    for (std::size_t i = 0; i < x.components(); ++i)
      for (const double value : x.component(i)) poison += value - value;
    if (poison != 0 || poison != poison)
      for (std::size_t n = 0; n < x.nodes(); ++n) fail_if_not_finite(x, n, failures);
    sort_failures(failures, failed_before);
    statistics_.node_segments += x.nodes();
  }

  std::unique_ptr<Flow> clone() const override { return make_exact_flow(field_.model()); }
  std::string_view name() const override { return "exact"; }

 private:
  void stay_on_bound(std::size_t i, std::span<const double> before, BatchView x) const {
    const StateBound& bound = field_.model().bounds[i];
    for (std::size_t n = 0; n < before.size(); ++n)
      if (before[n] == bound.lower || before[n] == bound.upper) x(i, n) = before[n];
  }

  SegmentField field_;
  std::vector<std::size_t> absorbing_;
  Batch before_;
};

}  // namespace

std::unique_ptr<Flow> make_exact_flow(const Model& model) { return std::make_unique<ExactFlow>(model); }

}  // namespace wienertree
