#include "wienertree/cubature/flow.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/cubature/flow_methods.hpp"

namespace wienertree {

FlowStatistics& FlowStatistics::operator+=(const FlowStatistics& other) {
  node_segments += other.node_segments;
  field_evaluations += other.field_evaluations;
  cvode_nodes += other.cvode_nodes;
  return *this;
}

void Flow::move_along(const CubaturePath& path, double s, BatchView x, std::vector<NodeFailure>& failures) {
  const auto before = static_cast<std::ptrdiff_t>(failures.size());
  increments_.resize(static_cast<std::size_t>(path.increments.rows()));
  const auto by_node = [](const NodeFailure& a, const NodeFailure& b) { return a.node < b.node; };
  for (std::size_t segment = 0; segment < static_cast<std::size_t>(path.increments.cols()); ++segment) {
    scaled_increments(path, segment, s, increments_);
    const auto known = static_cast<std::ptrdiff_t>(failures.size());
    move(increments_, x, failures);
    if (static_cast<std::ptrdiff_t>(failures.size()) == known || known == before) continue;
    // A node is reported for the first segment on which it fails.
    const auto first = failures.begin() + before, middle = failures.begin() + known;
    failures.erase(std::remove_if(middle, failures.end(),
                                  [&](const NodeFailure& failure) {
                                    return std::binary_search(first, middle, failure, by_node);
                                  }),
                   failures.end());
    std::inplace_merge(failures.begin() + before, failures.begin() + known, failures.end(), by_node);
  }
}

bool fail_if_not_finite(BatchView x, std::size_t n, std::vector<NodeFailure>& failures) {
  for (std::size_t i = 0; i < x.components(); ++i) {
    if (std::isfinite(x(i, n))) continue;
    failures.push_back({n, i, x(i, n), FailureReason::not_finite});
    for (std::size_t l = 0; l < x.components(); ++l) x(l, n) = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  return false;
}

void sort_failures(std::vector<NodeFailure>& failures, std::size_t first) {
  const auto begin = failures.begin() + static_cast<std::ptrdiff_t>(first);
  std::stable_sort(begin, failures.end(),
                   [](const NodeFailure& a, const NodeFailure& b) { return a.node < b.node; });
  failures.erase(std::unique(begin, failures.end(),
                             [](const NodeFailure& a, const NodeFailure& b) { return a.node == b.node; }),
                 failures.end());
}

std::unique_ptr<Flow> make_flow(FlowMethod method, const Model& model, FlowTolerance tolerance, int degree) {
  const auto require_positive = [](double value, const char* name) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw InputError(fmt::format("{} must be positive and finite", name), "flow", fmt::format("{}", value));
  };
  require_positive(tolerance.relative, "the relative tolerance");
  require_positive(tolerance.absolute, "the absolute tolerance");
  if (degree < 1)
    throw InputError("the degree of the formula must be positive", "flow", std::to_string(degree));
  const bool closed_form = model.fields->has_exact_flow();
  if (method == FlowMethod::exact && !closed_form)
    throw InputError(fmt::format("the fields of model {} have no closed-form flow; methods that apply: auto, "
                                 "explicit, cvode",
                                 model.name),
                     "flow", "exact");
  if (method == FlowMethod::automatic) method = closed_form ? FlowMethod::exact : FlowMethod::explicit_;
  switch (method) {
    case FlowMethod::exact:
      return make_exact_flow(model);
    case FlowMethod::cvode:
      return make_cvode_flow(model, tolerance);
    default:
      return make_explicit_flow(model, tolerance, degree);
  }
}

}  // namespace wienertree
