#include "wienertree/tree/genealogy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/graph/breadth_first_search.hpp>
#include <boost/graph/two_bit_color_map.hpp>
#include <boost/pending/queue.hpp>
#include <ranges>
#include <unordered_map>

#include "wienertree/numeric/error.hpp"
#include "wienertree/tree/genealogy_graph.hpp"

namespace wienertree {
namespace {

/// Calls `discover` on every vertex the search comes to.
template <class Discover>
struct DiscoveryVisitor : boost::default_bfs_visitor {
  explicit DiscoveryVisitor(Discover& d) : discover(&d) {}
  void discover_vertex(NodeId node, const Genealogy&) const { (*discover)(node); }
  Discover* discover;
};

}  // namespace

Genealogy::Genealogy(KeptAttributes kept, std::vector<std::string> state_names)
    : kept_(kept), state_names_(std::move(state_names)) {}

void Genealogy::append(const Generation& generation, std::span<const double> log_likelihood) {
  const std::size_t n = generation.size();
  const std::string where = fmt::format("genealogy, generation {}", generations());
  if (n == 0) throw InputError("a generation has no nodes", where);
  if (!log_likelihood.empty() && log_likelihood.size() != n)
    throw InputError(fmt::format("{} nodes need a likelihood each", n), where,
                     fmt::format("{}", log_likelihood.size()));
  Level level;
  level.time = generation.time;
  level.size = n;
  level.before = nodes();
  if (!levels_.empty()) {
    if (generation.parent.size() != n || generation.branch.size() != n)
      throw InputError(
          fmt::format("{} nodes need a parent and a branch each", n), where,
          fmt::format("{} parents, {} branches", generation.parent.size(), generation.branch.size()));
    for (const std::uint32_t parent : generation.parent)
      if (parent >= levels_.back().size)
        throw InputError(fmt::format("a parent is not one of the {} nodes before", levels_.back().size),
                         where, fmt::format("{}", parent));
    level.parent = generation.parent;
    level.branch = generation.branch;
  }
  if (kept_.states) {
    level.states.reshape(generation.states.components(), n);
    for (std::size_t c = 0; c < generation.states.components(); ++c)
      std::ranges::copy(generation.states.component(c), level.states.component(c).begin());
  }
  if (kept_.counts) level.count = generation.count;
  if (kept_.likelihoods) level.log_likelihood.assign(log_likelihood.begin(), log_likelihood.end());
  if (kept_.weights) {
    level.log_weight = generation.log_weight;
    for (std::size_t i = 0; i < generation.log_likelihood.size(); ++i)
      level.log_weight[i] += generation.log_likelihood[i];
  }
  levels_.push_back(std::move(level));
}

std::vector<NodeId> ancestral_line(const Genealogy& genealogy, NodeId node) {
  if (generation_of(node) >= genealogy.generations() || index_of(node) >= genealogy.size(generation_of(node)))
    throw InputError("no such node", "genealogy",
                     fmt::format("generation {}, index {}", generation_of(node), index_of(node)));
  std::vector<NodeId> line(generation_of(node) + 1);
  const auto record = [&](NodeId ancestor) { line[generation_of(ancestor)] = ancestor; };
  std::unordered_map<NodeId, boost::default_color_type> color;
  boost::queue<NodeId> queue;
  boost::breadth_first_visit(genealogy, node, queue, DiscoveryVisitor(record),
                             boost::make_assoc_property_map(color));
  return line;
}

std::vector<std::size_t> distinct_ancestors(const Genealogy& genealogy) {
  std::vector<std::size_t> distinct(genealogy.generations());
  if (distinct.empty()) return distinct;
  const auto count = [&](NodeId ancestor) { ++distinct[generation_of(ancestor)]; };
  const GenealogyVertexIterator last(genealogy, genealogy.generations() - 1),
      end(genealogy, genealogy.generations());
  boost::queue<NodeId> queue;
  boost::breadth_first_visit(
      genealogy, last, end, queue, DiscoveryVisitor(count),
      boost::two_bit_color_map<GenealogyIndexMap>(genealogy.nodes(), get(boost::vertex_index, genealogy)));
  return distinct;
}

std::optional<NodeId> most_recent_common_ancestor(const Genealogy& genealogy) {
  const std::vector<std::size_t> distinct = distinct_ancestors(genealogy);
  const auto several = std::find_if(distinct.begin(), distinct.end(), [](std::size_t n) { return n > 1; });
  if (several == distinct.begin()) return std::nullopt;
  const auto generation = static_cast<std::size_t>(several - distinct.begin()) - 1;
  return ancestral_line(genealogy, node_id(genealogy.generations() - 1, 0))[generation];
}

std::vector<double> ancestral_weights(const Genealogy& genealogy, std::span<const double> weight,
                                      std::size_t generation) {
  if (generation >= genealogy.generations())
    throw InputError(fmt::format("there are {} generations", genealogy.generations()), "genealogy",
                     fmt::format("generation {}", generation));
  std::size_t g = genealogy.generations() - 1;
  if (weight.size() != genealogy.size(g))
    throw InputError(fmt::format("the last generation has {} nodes", genealogy.size(g)), "genealogy",
                     fmt::format("{} weights", weight.size()));
  std::vector<double> gathered(weight.begin(), weight.end()), above;
  for (; g > generation; --g) {
    above.assign(genealogy.size(g - 1), 0.0);
    for (std::size_t i = 0; i < gathered.size(); ++i) above[genealogy.parents(g)[i]] += gathered[i];
    gathered.swap(above);
  }
  return gathered;
}

}  // namespace wienertree
