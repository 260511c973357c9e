#include "wienertree/tree/transition.hpp"

#include <limits>

#include "wienertree/numeric/error.hpp"

namespace wienertree {

void TransitionRule::reserve_children(const Generation& parents, std::size_t count, double s,
                                      const char* where, Generation& children) {
  const std::size_t nodes = parents.size();
  if (nodes > std::numeric_limits<std::uint32_t>::max() / count)
    throw InputError("too many children for 32-bit indices", where);
  children.time = parents.time + s;
  children.states.reshape(parents.states.components(), nodes * count);
  resize_unspecified(children.log_weight, nodes * count);
  resize_unspecified(children.log_likelihood, parents.log_likelihood.empty() ? 0 : nodes * count);
  resize_unspecified(children.parent, nodes * count);
  resize_unspecified(children.branch, nodes * count);
  children.count.clear();
}

std::size_t TransitionRule::place_child(const Generation& parents, std::size_t parent, std::size_t branch,
                                        double log_weight, Generation& children) {
  const std::size_t child = branch * parents.size() + parent;
  children.log_weight[child] = log_weight;
  children.parent[child] = static_cast<std::uint32_t>(parent);
  children.branch[child] = static_cast<std::uint16_t>(branch);
  if (!parents.log_likelihood.empty()) children.log_likelihood[child] = parents.log_likelihood[parent];
  return child;
}

}  // namespace wienertree
