#include "wienertree/tree/tree_size.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace wienertree {
namespace {

std::string_view reason(FailureReason r) {
  switch (r) {
    case FailureReason::not_finite:
      return "the node's state is not finite";
    case FailureReason::tolerance_not_reached:
      return "the node's ODE could not be solved to tolerance";
    case FailureReason::left_bounds:
      return "the node left the state's bounds";
  }
  return "";
}

// What the solver's own words mean for the model, and what to try.
std::string_view advice(FailureReason r) {
  switch (r) {
    case FailureReason::not_finite:
      return "a coefficient is not finite where the path leads; shorter steps (--steps) or bounds of the "
             "state may help";
    case FailureReason::tolerance_not_reached:
      return "the state grows without bound along the path, or a coefficient is not smooth there; shorter "
             "steps "
             "(--steps), a looser --rtol or --atol, or bounds of the state may help";
    case FailureReason::left_bounds:
      return "shorter steps (--steps) may help, and --on-node-failure drop leaves such nodes out";
  }
  return "";
}

}  // namespace

UnprunedSize unpruned_size(const CubatureFormula& formula, const Model& model, std::size_t steps,
                           std::size_t roots) {
  const double leaves = static_cast<double>(roots) *
                        std::pow(static_cast<double>(formula.paths.size()), static_cast<double>(steps));
  const auto d = static_cast<double>(model.state_dimension()),
             k = static_cast<double>(model.fields->sensor_dimension());
  // Two generations of states, weight, likelihood, parent and branch; normalised weights and sensor values of
  // one.
  const double bytes_a_node = 2 * (8 * d + 8 + 8 + 4 + 2) + 8 + 8 * k;
  return {leaves, leaves * bytes_a_node};
}

void refuse_oversized_tree(const CubatureFormula& formula, const Model& model, std::size_t steps,
                           double memory_limit, std::size_t roots) {
  const UnprunedSize size = unpruned_size(formula, model, steps, roots);
  if (size.bytes <= memory_limit) return;
  throw InputError(
      fmt::format("the unpruned tree of {} steps has {}^{} = {:.3g} leaves and needs about {:.3g} GB, over "
                  "the limit of "
                  "{:.3g} GB: thin it (--thin recombination --nodes N) or take fewer steps (--steps)",
                  steps, formula.paths.size(), steps, size.leaves, size.bytes / 1e9, memory_limit / 1e9),
      "tree");
}

void refuse_oversized_step(const CubatureFormula& formula, const Model& model, std::size_t nodes,
                           double memory_limit) {
  const double bytes = unpruned_size(formula, model, 1, nodes).bytes;
  if (bytes <= memory_limit) return;
  throw InputError(
      fmt::format("a step from {} nodes along {} paths needs about {:.3g} GB, over the limit of {:.3g} GB: "
                  "keep fewer nodes (--nodes)",
                  nodes, formula.paths.size(), bytes / 1e9, memory_limit / 1e9),
      "tree");
}

void throw_node_failure(const std::vector<NodeFailure>& failures, const Model& model,
                        const std::string& where) {
  const NodeFailure& f = *std::min_element(failures.begin(), failures.end(),
                                           [](const auto& a, const auto& b) { return a.node < b.node; });
  const std::string solver =
      f.message.empty() ? "" : fmt::format(": {}; the solver says: {}", advice(f.reason), f.message);
  throw RunError(fmt::format("{}{} ({} node{} failed)", reason(f.reason), solver, failures.size(),
                             failures.size() == 1 ? "" : "s"),
                 fmt::format("{}, node {}, state {}", where, f.node, model.state_names[f.state]),
                 fmt::format("{}", f.value));
}

void check_formula_fits(const CubatureFormula& formula, const Model& model) {
  if (!formula.paths.empty() && formula.dimension == static_cast<int>(model.noise_dimension())) return;
  throw InputError(
      fmt::format("the model has {} Brownian motion{}, the cubature formula {}", model.noise_dimension(),
                  model.noise_dimension() == 1 ? "" : "s", formula.dimension),
      "formula " + formula.name);
}

}  // namespace wienertree
