#include "wienertree/model/text/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <unordered_map>
#include <utility>

namespace wienertree::text {

namespace {

template <class T>
int three_way(const T& a, const T& b) {
  return a < b ? -1 : (b < a ? 1 : 0);
}

int rank(Expression e) {
  if (e->kind != Node::Kind::symbol) return static_cast<int>(e->kind) * 4;
  return static_cast<int>(e->kind) * 4 + static_cast<int>(e->role);
}

bool visit(Expression e, std::unordered_set<Expression>& seen,
           const std::function<bool(Expression)>& predicate) {
  if (!seen.insert(e).second) return false;
  if (predicate(e)) return true;
  return std::any_of(e->operands.begin(), e->operands.end(),
                     [&](Expression operand) { return visit(operand, seen, predicate); });
}

bool any_part(Expression e, const std::function<bool(Expression)>& predicate) {
  std::unordered_set<Expression> seen;
  return visit(e, seen, predicate);
}

}  // namespace

int compare(Expression a, Expression b) {
  if (a == b) return 0;
  if (const int order = three_way(rank(a), rank(b))) return order;
  switch (a->kind) {
    case Node::Kind::number:
      if (const int order = three_way(a->number, b->number)) return order;
      return three_way(a->name, b->name);
    case Node::Kind::symbol:
      return three_way(a->index, b->index);
    case Node::Kind::function:
      if (const int order = three_way(a->op, b->op)) return order;
      break;
    default:
      break;
  }
  if (const int order = three_way(a->operands.size(), b->operands.size())) return order;
  for (std::size_t i = 0; i < a->operands.size(); ++i)
    if (const int order = compare(a->operands[i], b->operands[i])) return order;
  return 0;
}

std::size_t Arena::Hash::operator()(Expression e) const {
  std::size_t h = std::hash<std::string>{}(e->name) ^ std::hash<double>{}(e->number);
  const auto mix = [&h](std::size_t v) { h = (h ^ v) * 0x9E3779B97F4A7C15U + (h >> 29U); };
  mix(static_cast<std::size_t>(e->kind));
  mix(static_cast<std::size_t>(e->role));
  mix(e->index);
  mix(static_cast<std::size_t>(e->op));
  for (Expression operand : e->operands) mix(std::hash<Expression>{}(operand));
  return h;
}

bool Arena::Equal::operator()(Expression a, Expression b) const {
  return a->kind == b->kind && a->number == b->number && a->name == b->name && a->role == b->role &&
         a->index == b->index && a->op == b->op && a->operands == b->operands;
}

Expression Arena::intern(Node node) {
  if (const auto found = known_.find(&node); found != known_.end()) return *found;
  nodes_.push_back(std::move(node));
  known_.insert(&nodes_.back());
  return &nodes_.back();
}

Expression Arena::number(double value, std::string printed) {
  Node node;
  node.kind = Node::Kind::number;
  node.number = value + 0.0;  // -0 becomes 0
  node.name = printed.empty() ? fmt::format("{}", node.number) : std::move(printed);
  return intern(std::move(node));
}

Expression Arena::pi() {
  Node node;
  node.kind = Node::Kind::pi;
  node.number = std::numbers::pi;
  return intern(std::move(node));
}

Expression Arena::symbol(Role role, std::size_t index, const std::string& name) {
  Node node;
  node.kind = Node::Kind::symbol;
  node.role = role;
  node.index = index;
  node.name = name;
  return intern(std::move(node));
}

Expression Arena::power(Expression base, Expression exponent) {
  Node node;
  node.kind = Node::Kind::power;
  node.operands = {base, exponent};
  return intern(std::move(node));
}

Expression Arena::function(Op op, std::vector<Expression> arguments) {
  Node node;
  node.kind = Node::Kind::function;
  node.op = op;
  node.operands = std::move(arguments);
  return intern(std::move(node));
}

Expression Arena::sum(std::vector<Expression> terms) {
  if (terms.empty()) return number(0);
  if (terms.size() == 1) return terms.front();
  // Like terms side by side whatever their coefficients, numbers first.
  std::vector<std::pair<Term, Expression>> sorted;
  sorted.reserve(terms.size());
  for (Expression term : terms) sorted.emplace_back(split(term, *this), term);
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    if ((a.first.rest == nullptr) != (b.first.rest == nullptr)) return a.first.rest == nullptr;
    if (a.first.rest != b.first.rest) return compare(a.first.rest, b.first.rest) < 0;
    return a.first.coefficient < b.first.coefficient;
  });
  Node node;
  node.kind = Node::Kind::sum;
  for (const auto& [key, term] : sorted) node.operands.push_back(term);
  return intern(std::move(node));
}

Expression Arena::product(std::vector<Expression> factors) {
  if (factors.empty()) return number(1);
  if (factors.size() == 1) return factors.front();
  std::sort(factors.begin(), factors.end(), [](Expression a, Expression b) { return compare(a, b) < 0; });
  Node node;
  node.kind = Node::Kind::product;
  node.operands = std::move(factors);
  return intern(std::move(node));
}

Term split(Expression term, Arena& arena) {
  if (term->is_number()) return {term->number, nullptr};
  if (term->kind != Node::Kind::product || !term->operands.front()->is_number()) return {1.0, term};
  return {term->operands.front()->number, arena.product({term->operands.begin() + 1, term->operands.end()})};
}

double size(Expression e) {
  std::unordered_map<Expression, double> known;
  const std::function<double(Expression)> count = [&](Expression part) {
    if (const auto found = known.find(part); found != known.end()) return found->second;
    double nodes = 1;
    for (Expression operand : part->operands) nodes += count(operand);
    known.emplace(part, nodes);
    return nodes;
  };
  return count(e);
}

bool contains(Expression e, Role role) {
  return any_part(e,
                  [role](Expression part) { return part->kind == Node::Kind::symbol && part->role == role; });
}

bool contains(Expression e, Role role, std::size_t index) {
  return any_part(e, [role, index](Expression part) {
    return part->kind == Node::Kind::symbol && part->role == role && part->index == index;
  });
}

bool is_piecewise(Expression e) {
  return any_part(
      e, [](Expression part) { return part->kind == Node::Kind::function && is_piecewise(part->op); });
}

}  // namespace wienertree::text
