#include "wienertree/tree/square_root_transition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/cubature/square_root_rule.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {

namespace {

std::size_t rule_nodes(int degree) { return static_cast<std::size_t>(std::clamp((degree + 1) / 2, 2, 4)); }

// The children of one value of one component: v, the integral, the log of the weight.
struct Fan {
  std::array<double, 2 * SquareRootRule::most_nodes> v, integral, log_weight;
  std::size_t size = 0;
};

Fan fan_of(const SquareRootRule& rule, double w, bool integrated) {
  const SquareRootRule::Children children = rule.children(w);
  Fan fan;
  for (std::size_t k = 0; k < rule.nodes(); ++k)
    for (std::size_t f = 0; f < (integrated ? 2U : 1U); ++f) {
      fan.v[fan.size] = children.v[k];
      fan.integral[fan.size] = children.integral[k][f];
      fan.log_weight[fan.size] = std::log(children.weight[k] * (integrated ? children.share[k][f] : 1.0));
      ++fan.size;
    }
  return fan;
}

}  // namespace

SquareRootTransition::SquareRootTransition(SquareRootStructure structure)
    : structure_(std::move(structure)), integrated_(structure_.components.size(), false) {
  if (structure_.price) throw InputError("a price has no rule of its own", "square-root transition");
  for (const SquareRootStructure::Integral& integral : structure_.integrals)
    for (std::size_t k = 0; k < integrated_.size(); ++k)
      if (integral.of_component[k] != 0) integrated_[k] = true;
}

std::size_t SquareRootTransition::branches(int degree) const {
  std::size_t count = 1;
  for (const bool integrated : integrated_) count *= rule_nodes(degree) * (integrated ? 2 : 1);
  return count;
}

void SquareRootTransition::grow(const Generation& parents, int degree, double s, ThreadPool* threads,
                                Generation& children) const {
  const std::size_t nodes = parents.size(), count = branches(degree), K = structure_.components.size();
  if (nodes > std::numeric_limits<std::uint32_t>::max() / count)
    throw InputError("too many children for 32-bit indices", "square-root transition");
  children.time = parents.time + s;
  children.states.reshape(parents.states.components(), nodes * count);
  resize_unspecified(children.log_weight, nodes * count);
  resize_unspecified(children.log_likelihood, parents.log_likelihood.empty() ? 0 : nodes * count);
  resize_unspecified(children.parent, nodes * count);
  resize_unspecified(children.branch, nodes * count);
  children.count.clear();
  std::vector<SquareRootRule> rules;
  for (const SquareRootStructure::Component& component : structure_.components)
    rules.emplace_back(component.process, s, rule_nodes(degree), structure_.nonnegative_integrals);
  constexpr std::size_t block = 64;
  for_blocks(threads, nodes, block, [&](std::size_t first, std::size_t in_block, std::size_t) {
    std::vector<Fan> fans(K);
    for (std::size_t n = first; n < first + in_block; ++n) {
      for (std::size_t k = 0; k < K; ++k) {
        const SquareRootStructure::Component& component = structure_.components[k];
        const double w = std::max(0.0, parents.states(component.state, n) + component.shift);
        fans[k] = fan_of(rules[k], w, integrated_[k]);
      }
      for (std::size_t branch = 0; branch < count; ++branch) {
        const std::size_t child = branch * nodes + n;
        double log_weight = parents.log_weight[n];
        for (const SquareRootStructure::Integral& integral : structure_.integrals)
          children.states(integral.state, child) = parents.states(integral.state, n) + integral.constant * s;
        std::size_t digits = branch;
        for (std::size_t k = 0; k < K; ++k) {
          const Fan& fan = fans[k];
          const std::size_t digit = digits % fan.size;
          digits /= fan.size;
          log_weight += fan.log_weight[digit];
          const SquareRootStructure::Component& component = structure_.components[k];
          children.states(component.state, child) = fan.v[digit] - component.shift;
          for (const SquareRootStructure::Integral& integral : structure_.integrals)
            children.states(integral.state, child) += integral.of_component[k] * fan.integral[digit];
        }
        children.log_weight[child] = log_weight;
        children.parent[child] = static_cast<std::uint32_t>(n);
        children.branch[child] = static_cast<std::uint16_t>(branch);
        if (!parents.log_likelihood.empty()) children.log_likelihood[child] = parents.log_likelihood[n];
      }
    }
  });
}

}  // namespace wienertree
