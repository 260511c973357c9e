#pragma once
/// A Genealogy as a graph of the Boost Graph Library (Siek, Lee, Lumsdaine 2002, The Boost Graph Library),
/// without a copy: include this header and hand the genealogy to an algorithm.
///
/// Vertices are NodeIds. `Genealogy` itself has an edge from every node to its parent, and models
/// VertexListGraph, EdgeListGraph and IncidenceGraph. `Descent` is a view of it with the edges turned round,
/// from parent to child, and models VertexListGraph and EdgeListGraph: what writers want. Both have the
/// property vertex_index.
#include <boost/graph/graph_traits.hpp>
#include <boost/graph/properties.hpp>
#include <boost/iterator/iterator_facade.hpp>
#include <boost/property_map/property_map.hpp>
#include <cstdint>
#include <utility>

#include "wienertree/tree/genealogy.hpp"

namespace wienertree {

struct GenealogyEdge {
  NodeId source = 0, target = 0;
  friend bool operator==(const GenealogyEdge&, const GenealogyEdge&) = default;
};

/// All nodes, generation by generation; a position past the last node of a generation is the first of the
/// next.
class GenealogyVertexIterator
    : public boost::iterator_facade<GenealogyVertexIterator, NodeId, boost::forward_traversal_tag, NodeId> {
 public:
  GenealogyVertexIterator() = default;
  GenealogyVertexIterator(const Genealogy& g, std::size_t generation)
      : genealogy_(&g), generation_(generation) {}

 private:
  friend class boost::iterator_core_access;
  NodeId dereference() const { return node_id(generation_, index_); }
  bool equal(const GenealogyVertexIterator& other) const {
    return generation_ == other.generation_ && index_ == other.index_;
  }
  void increment() {
    if (++index_ < genealogy_->size(generation_)) return;
    ++generation_;
    index_ = 0;
  }
  const Genealogy* genealogy_ = nullptr;
  std::size_t generation_ = 0, index_ = 0;
};

inline NodeId parent_of(NodeId node, const Genealogy& g) {
  return node_id(generation_of(node) - 1, g.parents(generation_of(node))[index_of(node)]);
}

/// The edges of the nodes after the root generation. Forward: from parent to child.
template <bool forward>
class GenealogyEdgeIterator : public boost::iterator_facade<GenealogyEdgeIterator<forward>, GenealogyEdge,
                                                            boost::forward_traversal_tag, GenealogyEdge> {
 public:
  GenealogyEdgeIterator() = default;
  GenealogyEdgeIterator(const Genealogy& g, std::size_t generation) : genealogy_(&g), child_(g, generation) {}

 private:
  friend class boost::iterator_core_access;
  GenealogyEdge dereference() const {
    const NodeId child = *child_, parent = parent_of(child, *genealogy_);
    return forward ? GenealogyEdge{parent, child} : GenealogyEdge{child, parent};
  }
  bool equal(const GenealogyEdgeIterator& other) const { return child_ == other.child_; }
  void increment() { ++child_; }
  const Genealogy* genealogy_ = nullptr;
  GenealogyVertexIterator child_;
};

/// The edge of one node to its parent, if it has one.
class GenealogyOutEdgeIterator : public boost::iterator_facade<GenealogyOutEdgeIterator, GenealogyEdge,
                                                               boost::forward_traversal_tag, GenealogyEdge> {
 public:
  GenealogyOutEdgeIterator() = default;
  GenealogyOutEdgeIterator(GenealogyEdge edge, bool past) : edge_(edge), past_(past) {}

 private:
  friend class boost::iterator_core_access;
  GenealogyEdge dereference() const { return edge_; }
  bool equal(const GenealogyOutEdgeIterator& other) const { return past_ == other.past_; }
  void increment() { past_ = true; }
  GenealogyEdge edge_;
  bool past_ = true;
};

/// Number of a vertex, 0 .. nodes-1.
struct GenealogyIndexMap {
  using key_type = NodeId;
  using value_type = std::size_t;
  using reference = std::size_t;
  using category = boost::readable_property_map_tag;
  const Genealogy* genealogy = nullptr;
  friend std::size_t get(const GenealogyIndexMap& map, NodeId node) {
    return map.genealogy->nodes_before(generation_of(node)) + index_of(node);
  }
};

/// The genealogy is kept by reference and must outlive the view.
struct Descent {
  const Genealogy* genealogy = nullptr;
};

struct GenealogyTraversal : boost::vertex_list_graph_tag,
                            boost::edge_list_graph_tag,
                            boost::incidence_graph_tag {};
struct DescentTraversal : boost::vertex_list_graph_tag, boost::edge_list_graph_tag {};

inline std::pair<GenealogyVertexIterator, GenealogyVertexIterator> vertices(const Genealogy& g) {
  return {{g, 0}, {g, g.generations()}};
}
inline std::size_t num_vertices(const Genealogy& g) { return g.nodes(); }
inline std::size_t num_edges(const Genealogy& g) { return g.nodes() == 0 ? 0 : g.nodes() - g.size(0); }
template <bool forward>
std::pair<GenealogyEdgeIterator<forward>, GenealogyEdgeIterator<forward>> edges_of(const Genealogy& g) {
  return {{g, g.nodes() == 0 ? 0U : 1U}, {g, g.generations()}};
}
inline auto edges(const Genealogy& g) { return edges_of<false>(g); }
inline NodeId source(const GenealogyEdge& edge, const Genealogy&) { return edge.source; }
inline NodeId target(const GenealogyEdge& edge, const Genealogy&) { return edge.target; }
inline std::size_t out_degree(NodeId node, const Genealogy&) { return generation_of(node) == 0 ? 0 : 1; }
inline std::pair<GenealogyOutEdgeIterator, GenealogyOutEdgeIterator> out_edges(NodeId node,
                                                                               const Genealogy& g) {
  if (generation_of(node) == 0) return {};
  const GenealogyEdge edge{node, parent_of(node, g)};
  return {{edge, false}, {edge, true}};
}
inline GenealogyIndexMap get(boost::vertex_index_t, const Genealogy& g) { return {&g}; }
inline std::size_t get(boost::vertex_index_t, const Genealogy& g, NodeId node) {
  return get(GenealogyIndexMap{&g}, node);
}

inline auto vertices(const Descent& d) { return vertices(*d.genealogy); }
inline std::size_t num_vertices(const Descent& d) { return num_vertices(*d.genealogy); }
inline std::size_t num_edges(const Descent& d) { return num_edges(*d.genealogy); }
inline auto edges(const Descent& d) { return edges_of<true>(*d.genealogy); }
inline NodeId source(const GenealogyEdge& edge, const Descent&) { return edge.source; }
inline NodeId target(const GenealogyEdge& edge, const Descent&) { return edge.target; }
inline GenealogyIndexMap get(boost::vertex_index_t, const Descent& d) { return {d.genealogy}; }
inline std::size_t get(boost::vertex_index_t, const Descent& d, NodeId node) {
  return get(GenealogyIndexMap{d.genealogy}, node);
}

}  // namespace wienertree

namespace boost {

template <>
struct graph_traits<wienertree::Genealogy> {
  using vertex_descriptor = wienertree::NodeId;
  using edge_descriptor = wienertree::GenealogyEdge;
  using directed_category = directed_tag;
  using edge_parallel_category = disallow_parallel_edge_tag;
  using traversal_category = wienertree::GenealogyTraversal;
  using vertex_iterator = wienertree::GenealogyVertexIterator;
  using edge_iterator = wienertree::GenealogyEdgeIterator<false>;
  using out_edge_iterator = wienertree::GenealogyOutEdgeIterator;
  using vertices_size_type = std::size_t;
  using edges_size_type = std::size_t;
  using degree_size_type = std::size_t;
  static vertex_descriptor null_vertex() { return ~vertex_descriptor{0}; }
};

template <>
struct graph_traits<wienertree::Descent> : graph_traits<wienertree::Genealogy> {
  using traversal_category = wienertree::DescentTraversal;
  using edge_iterator = wienertree::GenealogyEdgeIterator<true>;
  using out_edge_iterator = void;
  using degree_size_type = void;
};

template <>
struct property_map<wienertree::Genealogy, vertex_index_t> {
  using type = wienertree::GenealogyIndexMap;
  using const_type = type;
};
template <>
struct property_map<wienertree::Descent, vertex_index_t>
    : property_map<wienertree::Genealogy, vertex_index_t> {};

}  // namespace boost
