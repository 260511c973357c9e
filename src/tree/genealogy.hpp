#pragma once
/// The history of a tree: who came from whom along which path, generation by generation. 6 bytes a node;
/// states, weights and counts are kept where asked for. As a graph of the Boost Graph Library:
/// genealogy_graph.hpp.
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// A node of the history: its generation in the upper 32 bits, its index there in the lower.
using NodeId = std::uint64_t;
constexpr NodeId node_id(std::size_t generation, std::size_t index) {
  return NodeId{generation} << 32 | index;
}
constexpr std::size_t generation_of(NodeId node) { return node >> 32; }
constexpr std::size_t index_of(NodeId node) { return node & 0xffffffff; }

/// What to keep of a generation besides parents and branches.
struct KeptAttributes {
  bool states = false;
  bool weights = false;  ///< log_weight + log_likelihood
  bool counts = false;
  bool likelihoods = false;  ///< what `append` is told of them
};

/// Records generations as they come. A value: it can be copied, and is complete at any moment.
class Genealogy {
 public:
  /// @param state_names used by the writers; x0, x1, .. where there are too few
  explicit Genealogy(KeptAttributes kept = {}, std::vector<std::string> state_names = {});

  /// The first generation recorded is the root, whatever its parents.
  /// @param log_likelihood of the observations of the step that led to each node; empty if there are none
  /// @throws InputError if the generation is empty, if a node's parent is not a node of the generation
  /// before, or if there are likelihoods, but not one a node
  void append(const Generation& generation, std::span<const double> log_likelihood = {});

  std::size_t generations() const { return levels_.size(); }
  std::size_t size(std::size_t generation) const { return levels_[generation].size; }
  /// Nodes of all generations, and of those before one.
  std::size_t nodes() const {
    return levels_.empty() ? 0 : nodes_before(generations() - 1) + levels_.back().size;
  }
  std::size_t nodes_before(std::size_t generation) const { return levels_[generation].before; }

  double time(std::size_t generation) const { return levels_[generation].time; }
  /// Index in the generation before, per node; empty for the root.
  std::span<const std::uint32_t> parents(std::size_t generation) const { return levels_[generation].parent; }
  /// Path of the formula, per node; empty for the root.
  std::span<const std::uint16_t> branches(std::size_t generation) const { return levels_[generation].branch; }
  /// d x size, log-weights, particles, log-likelihoods; empty unless kept (and counted, and told).
  ConstBatchView states(std::size_t generation) const { return levels_[generation].states.view(); }
  std::span<const double> log_weights(std::size_t generation) const { return levels_[generation].log_weight; }
  std::span<const std::uint32_t> counts(std::size_t generation) const { return levels_[generation].count; }
  std::span<const double> log_likelihoods(std::size_t generation) const {
    return levels_[generation].log_likelihood;
  }
  const std::vector<std::string>& state_names() const { return state_names_; }

 private:
  struct Level {
    double time = 0;
    std::size_t size = 0, before = 0;
    Buffer<std::uint32_t> parent, count;
    Buffer<std::uint16_t> branch;
    Buffer<double> log_weight, log_likelihood;
    Batch states;
  };
  KeptAttributes kept_;
  std::vector<std::string> state_names_;
  std::vector<Level> levels_;
};

/// The line from the root to a node, both included: element g is the ancestor in generation g. Lines of nodes
/// drawn by their final weights are draws from the smoothing law. @throws InputError if there is no such node
std::vector<NodeId> ancestral_line(const Genealogy& genealogy, NodeId node);

/// Diversity: element g is the number of distinct ancestors in generation g of all nodes of the last
/// generation. Non-decreasing; its last element is the last generation's size.
std::vector<std::size_t> distinct_ancestors(const Genealogy& genealogy);

/// The latest node that is an ancestor of the whole last generation; none if that has several roots.
/// The time to it is time(last generation) - time(its generation).
std::optional<NodeId> most_recent_common_ancestor(const Genealogy& genealogy);

/// Smoothing marginal: the weights of the last generation gathered at their ancestors in `generation`, of
/// which there is one value a node.   @param weight one a node of the last generation
/// @throws InputError if the sizes do not fit or there is no such generation
std::vector<double> ancestral_weights(const Genealogy& genealogy, std::span<const double> weight,
                                      std::size_t generation);

/// The tree with its edges from parent to child as DOT or GraphML. Nodes carry `time` and, as far as kept,
/// the states under their names, `weight` (share of the generation's mass), `count` and `log_likelihood`
/// (GraphML: 0 where a generation has none); edges carry `branch`.
void write_graphviz(std::ostream& out, const Genealogy& genealogy);
void write_graphml(std::ostream& out, const Genealogy& genealogy);

}  // namespace wienertree
