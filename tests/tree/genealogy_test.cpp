// The history of a tree, as a value, as a graph, and as a file.
#include "wienertree/tree/genealogy.hpp"

#include <algorithm>
#include <boost/concept/assert.hpp>
#include <boost/graph/depth_first_search.hpp>
#include <boost/graph/graph_concepts.hpp>
#include <boost/graph/graph_utility.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <sstream>

#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/thinning.hpp"
#include "wienertree/tree/genealogy_graph.hpp"
#include "wienertree/tree/growth.hpp"

using namespace wienertree;

BOOST_CONCEPT_ASSERT((boost::VertexListGraphConcept<Genealogy>));
BOOST_CONCEPT_ASSERT((boost::EdgeListGraphConcept<Genealogy>));
BOOST_CONCEPT_ASSERT((boost::IncidenceGraphConcept<Genealogy>));
BOOST_CONCEPT_ASSERT((boost::ReadablePropertyGraphConcept<Genealogy, NodeId, boost::vertex_index_t>));
BOOST_CONCEPT_ASSERT((boost::VertexListGraphConcept<Descent>));
BOOST_CONCEPT_ASSERT((boost::EdgeListGraphConcept<Descent>));
BOOST_CONCEPT_ASSERT((boost::ReadablePropertyGraphConcept<Descent, NodeId, boost::vertex_index_t>));

namespace {

Generation generation(double time, const std::vector<std::uint32_t>& parent) {
  Generation g;
  const std::size_t n = parent.size();
  g.time = time;
  g.states.reshape(1, n);
  for (std::size_t i = 0; i < n; ++i) g.states(0, i) = time + static_cast<double>(i) / 10;
  g.log_weight.assign(n, 0.0);
  g.branch.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i) g.branch[i] = static_cast<std::uint16_t>(i % 2);
  g.parent.assign(parent.begin(), parent.end());
  return g;
}

/// A history by random parents: generations of random sizes, seldom coalescing or often.
Genealogy random_history(std::uint64_t seed, std::size_t generations, std::size_t most) {
  Genealogy history;
  std::size_t before = 1;
  std::uint64_t draw = 0;
  const RandomStream random{seed};
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random.uniform(draw++) * static_cast<double>(n));
  };
  for (std::size_t g = 0; g < generations; ++g) {
    const std::size_t n = 1 + below(most);
    std::vector<std::uint32_t> parent(n);
    for (auto& p : parent) p = g == 0 ? 0 : static_cast<std::uint32_t>(below(before));
    history.append(generation(static_cast<double>(g), parent));
    before = n;
  }
  return history;
}

// Brute force: the set of ancestors in generation g of the whole last generation.
std::set<std::size_t> ancestors(const Genealogy& history, std::size_t g) {
  std::set<std::size_t> found;
  for (std::size_t i = 0; i < history.size(history.generations() - 1); ++i) {
    std::size_t at = i;
    for (std::size_t j = history.generations() - 1; j > g; --j) at = history.parents(j)[at];
    found.insert(at);
  }
  return found;
}

}  // namespace

TEST_CASE("Ancestors, diversity and the common ancestor agree with brute force") {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const std::size_t generations = 1 + seed % 13, most = 1 + seed % 7;
    const Genealogy history = random_history(seed, generations, most);
    const std::vector<std::size_t> distinct = distinct_ancestors(history);
    REQUIRE(distinct.size() == generations);
    std::optional<NodeId> common;
    for (std::size_t g = 0; g < generations; ++g) {
      const auto found = ancestors(history, g);
      REQUIRE(distinct[g] == found.size());
      if (found.size() == 1) common = node_id(g, *found.begin());
    }
    REQUIRE(most_recent_common_ancestor(history) == common);
    const std::size_t last = generations - 1;
    for (std::size_t i = 0; i < history.size(last); ++i) {
      const auto line = ancestral_line(history, node_id(last, i));
      REQUIRE(line.size() == generations);
      REQUIRE(line[last] == node_id(last, i));
      for (std::size_t g = last; g > 0; --g) {
        REQUIRE(generation_of(line[g]) == g);
        REQUIRE(index_of(line[g - 1]) == history.parents(g)[index_of(line[g])]);
      }
    }
    std::vector<double> weight(history.size(last));
    for (std::size_t i = 0; i < weight.size(); ++i) weight[i] = 1.0 + static_cast<double>(i);
    for (std::size_t g = 0; g < generations; ++g) {
      const auto gathered = ancestral_weights(history, weight, g);
      std::vector<double> expected(history.size(g));
      for (std::size_t i = 0; i < weight.size(); ++i)
        expected[index_of(ancestral_line(history, node_id(last, i))[g])] += weight[i];
      REQUIRE(gathered == expected);  // sums of small integers
    }
  }
}

TEST_CASE("A history of one generation, and one that never coalesces") {
  Genealogy history;
  CHECK(distinct_ancestors(history).empty());
  CHECK_FALSE(most_recent_common_ancestor(history).has_value());
  history.append(generation(0, {0, 0, 0}));
  CHECK_FALSE(most_recent_common_ancestor(history).has_value());
  history.append(generation(1, {0, 1, 2}));
  CHECK(distinct_ancestors(history) == std::vector<std::size_t>{3, 3});
  CHECK_FALSE(most_recent_common_ancestor(history).has_value());
  history.append(generation(2, {1}));
  CHECK(most_recent_common_ancestor(history) == node_id(2, 0));
}

TEST_CASE("Histories that are none are refused") {
  Genealogy history;
  CHECK_THROWS_AS(history.append(generation(0, {})), InputError);
  history.append(generation(0, {0, 0}));
  CHECK_THROWS_WITH(history.append(generation(1, {0, 2})),
                    Catch::Contains("generation 1") && Catch::Contains("(2)"));
  Generation orphan = generation(1, {0, 1});
  orphan.parent.clear();
  CHECK_THROWS_AS(history.append(orphan), InputError);
  CHECK_THROWS_WITH(history.append(generation(1, {0, 1}), std::vector{0.0}),
                    Catch::Contains("likelihood") && Catch::Contains("(1)"));
  CHECK(history.generations() == 1);
  CHECK_THROWS_AS(ancestral_line(history, node_id(0, 2)), InputError);
  CHECK_THROWS_AS(ancestral_line(history, node_id(1, 0)), InputError);
  CHECK_THROWS_AS(ancestral_weights(history, std::vector<double>(3), 0), InputError);
  CHECK_THROWS_AS(ancestral_weights(history, std::vector<double>(2), 1), InputError);
}

TEST_CASE("As a graph: every node once, every edge to the parent, and back in the descent") {
  const Genealogy history = random_history(4, 6, 9);
  std::size_t number = 0;
  const auto index = get(boost::vertex_index, history);
  for (const NodeId node : boost::make_iterator_range(vertices(history))) {
    REQUIRE(get(index, node) == number++);
    const auto [first, last] = out_edges(node, history);
    REQUIRE(static_cast<std::size_t>(std::distance(first, last)) == out_degree(node, history));
    REQUIRE(out_degree(node, history) == (generation_of(node) > 0 ? 1 : 0));
    if (first != last)
      REQUIRE((source(*first, history) == node && target(*first, history) == parent_of(node, history)));
  }
  CHECK(number == num_vertices(history));
  std::size_t count = 0;
  auto down = edges(Descent{&history}).first;
  for (const GenealogyEdge& up : boost::make_iterator_range(edges(history))) {
    ++count;
    REQUIRE((*down == GenealogyEdge{up.target, up.source}));
    ++down;
  }
  CHECK(count == num_edges(history));
  CHECK(count == history.nodes() - history.size(0));

  // An algorithm of the library that needs both vertex list and out-edges: every root is finished before what
  // descends from it, for edges go up.
  struct Recorder : boost::dfs_visitor<> {
    std::vector<NodeId>* finished;
    void finish_vertex(NodeId node, const Genealogy&) const { finished->push_back(node); }
  } recorder;
  std::vector<NodeId> finished;
  recorder.finished = &finished;
  boost::depth_first_search(history, boost::visitor(recorder));
  REQUIRE(finished.size() == history.nodes());
  std::set<NodeId> seen;
  for (const NodeId node : finished) {
    if (generation_of(node) > 0) REQUIRE(seen.contains(parent_of(node, history)));
    seen.insert(node);
  }
}

TEST_CASE("Written as DOT and GraphML with all attributes") {
  Genealogy history({.states = true, .weights = true, .counts = true, .likelihoods = true}, {"x\"y"});
  Generation root = generation(0, {0}), next = generation(0.1, {0, 0});
  next.count = {3, 1};
  next.log_weight = {0.0, -1e6};
  next.log_likelihood = {0.0, 1e6};
  next.states(0, 0) = 1.0 / 3;
  history.append(root);
  history.append(next, std::vector{-0.5, -2.0});
  std::ostringstream dot;
  write_graphviz(dot, history);
  CHECK(dot.str() ==
        "digraph G {\n"
        "rankdir=LR;\n"
        "0[label=0, time=0, \"x\\\"y\"=0, weight=1];\n"
        "1[label=\"0.3333 (3)\", time=0.1, \"x\\\"y\"=0.3333333333333333, "
        "weight=0.5, count=3, log_likelihood=-0.5];\n"
        "2[label=\"0.2 (1)\", time=0.1, \"x\\\"y\"=0.2, weight=0.5, count=1, "
        "log_likelihood=-2];\n"
        "0->1 [branch=0];\n"
        "0->2 [branch=1];\n"
        "}\n");
  std::ostringstream xml;
  write_graphml(xml, history);
  for (const char* part :
       {"attr.name=\"time\" attr.type=\"double\"", "attr.name=\"x&quot;y\" attr.type=\"double\"",
        "attr.name=\"weight\" attr.type=\"double\"", "attr.name=\"count\" attr.type=\"int\"",
        "for=\"edge\" attr.name=\"branch\"", "0.3333333333333333<", "source=\"n0\" target=\"n2\""})
    CHECK_THAT(xml.str(), Catch::Contains(part));
}

TEST_CASE("Attributes are kept where asked for only") {
  const Genealogy bare = [] {
    Genealogy g;
    g.append(generation(0, {0}));
    g.append(generation(1, {0, 0, 0}));
    return g;
  }();
  CHECK(bare.states(1).nodes() == 0);
  CHECK(bare.log_weights(1).empty());
  CHECK(bare.counts(1).empty());
  CHECK(bare.parents(1).size() == 3);
  CHECK(bare.parents(0).empty());
  std::ostringstream dot, xml;
  write_graphviz(dot, bare);
  CHECK_THAT(dot.str(), Catch::Contains("0->3 [branch=0]") && !Catch::Contains("weight"));
  write_graphml(xml, bare);
  CHECK_THAT(xml.str(), !Catch::Contains("weight") && Catch::Contains("branch"));
  std::ostringstream empty;
  write_graphviz(empty, Genealogy());
  write_graphml(empty, Genealogy());
  CHECK_THAT(empty.str(), Catch::Contains("digraph") && Catch::Contains("graphml"));
}
