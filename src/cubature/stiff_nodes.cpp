#include "wienertree/cubature/stiff_nodes.hpp"

#include <algorithm>

namespace wienertree {

void StiffNodes::add(std::size_t node, double rest, std::span<const double> state) {
  entries_.push_back({node, states_.size(), rest});
  states_.insert(states_.end(), state.begin(), state.end());
}

void StiffNodes::finish(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures,
                        FlowStatistics& statistics) {
  if (entries_.empty()) return;
  if (!cvode_) {
    cvode_ = std::make_unique<CvodeBlock>(field_, tolerance_);
    block_.reshape(field_.dimension(), flow_block);
    rests_.resize(flow_block);
  }
  const std::uint64_t evaluations_before = cvode_->evaluations();
  std::ranges::sort(entries_, {}, &Entry::node);
  for (std::size_t first = 0, last = 0; first < entries_.size(); first = last) {
    while (last < entries_.size() && entries_[last].node / flow_block == entries_[first].node / flow_block)
      ++last;
    const std::span<const Entry> group(&entries_[first], last - first);
    const BatchView states = block_.view().nodes(0, group.size());
    for (std::size_t n = 0; n < group.size(); ++n) {
      rests_[n] = group[n].rest;
      for (std::size_t i = 0; i < x.components(); ++i) states(i, n) = states_[group[n].state + i];
    }
    const std::size_t known = failures.size();
    cvode_->move(D, {rests_.data(), group.size()}, states, failures);
    for (std::size_t f = known; f < failures.size(); ++f) failures[f].node = group[failures[f].node].node;
    for (std::size_t n = 0; n < group.size(); ++n)
      for (std::size_t i = 0; i < x.components(); ++i) x(i, group[n].node) = states(i, n);
  }
  statistics.cvode_nodes += entries_.size();
  statistics.field_evaluations += cvode_->evaluations() - evaluations_before;
  entries_.clear();
  states_.clear();
}

}  // namespace wienertree
