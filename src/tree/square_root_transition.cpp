#include "wienertree/tree/square_root_transition.hpp"

#include <algorithm>
#include <cmath>
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
  const std::size_t count = branches(degree), K = structure_.components.size();
  reserve_children(parents, count, s, "square-root transition", children);
  std::vector<SquareRootRule> rules;
  for (const SquareRootStructure::Component& component : structure_.components)
    rules.emplace_back(component.process, s, rule_nodes(degree), structure_.nonnegative_integrals);
  constexpr std::size_t block = 64;
  for_blocks(threads, parents.size(), block, [&](std::size_t first, std::size_t in_block, std::size_t) {
    std::vector<Fan> fans(K);
    for (std::size_t n = first; n < first + in_block; ++n) {
      for (std::size_t k = 0; k < K; ++k) {
        const SquareRootStructure::Component& component = structure_.components[k];
        const double w = std::max(0.0, parents.states(component.state, n) + component.shift);
        fans[k] = fan_of(rules[k], w, integrated_[k]);
      }
      for (std::size_t branch = 0; branch < count; ++branch) {
        double log_weight = parents.log_weight[n];
        std::size_t digits = branch;
        for (const Fan& fan : fans) {
          log_weight += fan.log_weight[digits % fan.size];
          digits /= fan.size;
        }
        const std::size_t child = place_child(parents, n, branch, log_weight, children);
        for (const SquareRootStructure::Integral& integral : structure_.integrals)
          children.states(integral.state, child) = parents.states(integral.state, n) + integral.constant * s;
        digits = branch;
        for (std::size_t k = 0; k < K; ++k) {
          const Fan& fan = fans[k];
          const std::size_t digit = digits % fan.size;
          digits /= fan.size;
          const SquareRootStructure::Component& component = structure_.components[k];
          children.states(component.state, child) = fan.v[digit] - component.shift;
          for (const SquareRootStructure::Integral& integral : structure_.integrals)
            children.states(integral.state, child) += integral.of_component[k] * fan.integral[digit];
        }
      }
    }
  });
}

}  // namespace wienertree
