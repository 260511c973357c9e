#include <fmt/format.h>

#include <algorithm>
#include <boost/graph/graphml.hpp>
#include <boost/graph/graphviz.hpp>
#include <boost/make_shared.hpp>
#include <boost/property_map/dynamic_property_map.hpp>
#include <cmath>
#include <limits>
#include <ostream>
#include <type_traits>
#include <typeinfo>

#include "wienertree/tree/genealogy.hpp"
#include "wienertree/tree/genealogy_graph.hpp"

namespace wienertree {
namespace {

std::string state_name(const Genealogy& g, std::size_t component) {
  return component < g.state_names().size() ? g.state_names()[component] : fmt::format("x{}", component);
}

std::uint16_t branch_of(const Genealogy& g, NodeId node) {
  return g.branches(generation_of(node))[index_of(node)];
}

/// An attribute computed from a node or an edge, written with all its digits (the library's own adaptor
/// writes six).
template <class Key, class Value>
class Attribute final : public boost::dynamic_property_map {
 public:
  explicit Attribute(Value value) : value_(std::move(value)) {}
  boost::any get(const boost::any& key) override { return value_(boost::any_cast<Key>(key)); }
  std::string get_string(const boost::any& key) override {
    return fmt::format("{}", value_(boost::any_cast<Key>(key)));
  }
  void put(const boost::any&, const boost::any&) override { throw boost::dynamic_const_put_error(); }
  const std::type_info& key() const override { return typeid(Key); }
  const std::type_info& value() const override { return typeid(std::invoke_result_t<const Value&, Key>); }

 private:
  Value value_;
};

template <class Key, class Value>
void add_attribute(boost::dynamic_properties& properties, const std::string& name, Value value) {
  properties.insert(boost::property_tree::xml_parser::encode_char_entities(name),
                    boost::make_shared<Attribute<Key, Value>>(std::move(value)));
}

/// log of each generation's mass, where weights were kept.
std::vector<double> log_masses(const Genealogy& g) {
  std::vector<double> mass;
  for (std::size_t j = 0; j < g.generations() && !g.log_weights(j).empty(); ++j) {
    const auto w = g.log_weights(j);
    const double largest = *std::max_element(w.begin(), w.end());
    double sum = 0;
    for (const double x : w) sum += std::exp(x - largest);
    mass.push_back(largest > -std::numeric_limits<double>::infinity() ? largest + std::log(sum) : 0.0);
  }
  return mass;
}

}  // namespace

void write_graphviz(std::ostream& out, const Genealogy& g) {
  const std::vector<double> log_mass = log_masses(g);
  const auto node_attributes = [&](std::ostream& o, NodeId node) {
    const std::size_t j = generation_of(node), i = index_of(node);
    const ConstBatchView x = g.states(j);
    std::string label,
        attributes = fmt::format("time={}", boost::escape_dot_string(fmt::format("{}", g.time(j))));
    const auto add = [&](const std::string& name, const std::string& value) {
      attributes += fmt::format(", {}={}", boost::escape_dot_string(name), boost::escape_dot_string(value));
    };
    for (std::size_t c = 0; c < x.components(); ++c) {
      add(state_name(g, c), fmt::format("{}", x(c, i)));
      label += fmt::format("{}{:.4g}", c == 0 ? "" : ", ", x(c, i));
    }
    if (!log_mass.empty()) add("weight", fmt::format("{}", std::exp(g.log_weights(j)[i] - log_mass[j])));
    if (!g.counts(j).empty()) {
      add("count", fmt::format("{}", g.counts(j)[i]));
      label += fmt::format("{}({})", label.empty() ? "" : " ", g.counts(j)[i]);
    }
    if (!g.log_likelihoods(j).empty()) add("log_likelihood", fmt::format("{}", g.log_likelihoods(j)[i]));
    o << "[label=" << boost::escape_dot_string(label) << ", " << attributes << "]";
  };
  const auto edge_attributes = [&](std::ostream& o, const GenealogyEdge& edge) {
    o << "[branch=" << branch_of(g, edge.target) << "]";
  };
  const auto graph_attributes = [](std::ostream& o) { o << "rankdir=LR;\n"; };
  boost::write_graphviz(out, Descent{&g}, node_attributes, edge_attributes, graph_attributes);
}

void write_graphml(std::ostream& out, const Genealogy& g) {
  const std::vector<double> log_mass = log_masses(g);
  boost::dynamic_properties properties;
  add_attribute<NodeId>(properties, "time", [&g](NodeId n) { return g.time(generation_of(n)); });
  const std::size_t components = g.generations() > 0 ? g.states(0).components() : 0;
  for (std::size_t c = 0; c < components; ++c)
    add_attribute<NodeId>(properties, state_name(g, c),
                          [&g, c](NodeId n) { return g.states(generation_of(n))(c, index_of(n)); });
  if (!log_mass.empty())
    add_attribute<NodeId>(properties, "weight", [&](NodeId n) {
      return std::exp(g.log_weights(generation_of(n))[index_of(n)] - log_mass[generation_of(n)]);
    });
  bool counted = false, likely = false;
  for (std::size_t j = 0; j < g.generations(); ++j) {
    counted |= !g.counts(j).empty();
    likely |= !g.log_likelihoods(j).empty();
  }
  if (counted)
    add_attribute<NodeId>(properties, "count", [&g](NodeId n) {
      const auto counts = g.counts(generation_of(n));
      return counts.empty() ? std::uint32_t{0} : counts[index_of(n)];
    });
  if (likely)
    add_attribute<NodeId>(properties, "log_likelihood", [&g](NodeId n) {
      const auto likelihoods = g.log_likelihoods(generation_of(n));
      return likelihoods.empty() ? 0.0 : likelihoods[index_of(n)];
    });
  add_attribute<GenealogyEdge>(properties, "branch",
                               [&g](const GenealogyEdge& e) { return branch_of(g, e.target); });
  boost::write_graphml(out, Descent{&g}, properties);
}

}  // namespace wienertree
