#pragma once
/// The three flows behind make_flow, and what they share.
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "wienertree/cubature/flow.hpp"

namespace wienertree {

/// Arguments as for make_flow, already verified.
std::unique_ptr<Flow> make_exact_flow(const Model& model);
std::unique_ptr<Flow> make_explicit_flow(const Model& model, FlowTolerance tolerance, int degree);
std::unique_ptr<Flow> make_cvode_flow(const Model& model, FlowTolerance tolerance);

/// If node n has a component that is not finite: reports the first such, makes the whole state NaN, returns
/// true.
bool fail_if_not_finite(BatchView x, std::size_t n, std::vector<NodeFailure>& failures);

/// The failures from index `first` on, sorted by node; of several of one node the first in order of component
/// stays.
void sort_failures(std::vector<NodeFailure>& failures, std::size_t first);

}  // namespace wienertree
