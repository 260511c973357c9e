// Values of a tape in the making: interned, folded, simplified.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "wienertree/model/tape.hpp"

namespace wienertree {

std::size_t TapeBuilder::KeyHash::operator()(const Key& key) const {
  // SplitMix64's finaliser over both words.
  std::uint64_t z = key.what * 0x9e3779b97f4a7c15u + key.operands;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return static_cast<std::size_t>(z ^ (z >> 31));
}

TapeBuilder::TapeBuilder(std::size_t inputs, std::size_t uniforms) : inputs_(inputs), uniforms_(uniforms) {}

TapeBuilder::Value TapeBuilder::intern(const Node& node) {
  const Key key{static_cast<std::uint64_t>(node.kind) << 8 | static_cast<std::uint64_t>(node.op),
                node.kind == Kind::constant ? std::bit_cast<std::uint64_t>(node.value)
                                            : static_cast<std::uint64_t>(node.a) << 32 | node.b};
  const auto [entry, is_new] = known_.try_emplace(key, static_cast<Value>(nodes_.size()));
  if (is_new) nodes_.push_back(node);
  return entry->second;
}

TapeBuilder::Value TapeBuilder::input(std::size_t i) {
  assert(i < inputs_);
  return intern({Kind::input, Op::add, false, static_cast<Value>(i), 0});
}

TapeBuilder::Value TapeBuilder::uniform(std::size_t i) {
  assert(i < uniforms_);
  return intern({Kind::uniform, Op::add, true, static_cast<Value>(i), 0});
}

TapeBuilder::Value TapeBuilder::constant(double c) {
  return intern({Kind::constant, Op::add, true, 0, 0, c});
}

std::optional<double> TapeBuilder::constant_value(Value v) const {
  assert(v < nodes_.size());
  return is_constant(v) ? std::optional(at(v).value) : std::nullopt;
}

/// Interns an operation that admits no further simplification but that of constant operands.
TapeBuilder::Value TapeBuilder::operation(Op op, Value a, Value b) {
  if (is_constant(a) && is_constant(b)) return constant(apply(op, at(a).value, at(b).value));
  return intern({Kind::operation, op, at(a).shared && at(b).shared, a, b});
}

TapeBuilder::Value TapeBuilder::unary(Op op, Value a) {
  assert(!is_binary(op) && a < nodes_.size());
  if (op == Op::negate) return negative(a);
  if (op == Op::absolute && is_operation(a, Op::negate)) return operation(op, at(a).a, at(a).a);
  if (op == Op::absolute && is_operation(a, Op::absolute)) return a;
  return operation(op, a, a);
}

TapeBuilder::Value TapeBuilder::binary(Op op, Value a, Value b) {
  assert(is_binary(op) && a < nodes_.size() && b < nodes_.size());
  if (is_constant(a) && is_constant(b)) return operation(op, a, b);
  switch (op) {
    case Op::add:
      return sum(a, b);
    case Op::subtract:
      return difference(a, b);
    case Op::multiply:
      return product(a, b);
    case Op::divide:
      return quotient(a, b);
    case Op::power:
      return power(a, b);
    case Op::where:
    case Op::unless:
      if (is_constant(a) && !std::isnan(at(a).value))
        return (at(a).value != 0) == (op == Op::where) ? b : constant(0.0);
      return operation(op, a, b);
    default:  // minimum, maximum: commutative and idempotent
      if (a == b) return a;
      return operation(op, std::max(a, b), std::min(a, b));
  }
}

TapeBuilder::Value TapeBuilder::negative(Value a) {
  if (is_operation(a, Op::negate)) return at(a).a;
  if (is_operation(a, Op::subtract)) return operation(Op::subtract, at(a).b, at(a).a);
  return operation(Op::negate, a, a);
}

TapeBuilder::Value TapeBuilder::sum(Value a, Value b) {
  if (is_constant(a, 0.0)) return b;
  if (is_constant(b, 0.0)) return a;
  if (is_operation(b, Op::negate)) return difference(a, at(b).a);
  if (is_operation(a, Op::negate)) return difference(b, at(a).a);
  return operation(Op::add, std::max(a, b), std::min(a, b));
}

TapeBuilder::Value TapeBuilder::difference(Value a, Value b) {
  if (a == b) return constant(0.0);
  if (is_constant(b, 0.0)) return a;
  if (is_constant(a, 0.0)) return negative(b);
  if (is_operation(b, Op::negate)) return sum(a, at(b).a);
  return operation(Op::subtract, a, b);
}

TapeBuilder::Value TapeBuilder::product(Value a, Value b) {
  // A shared factor stands second, a constant more so; the rest in the order in which they were made, latest
  // first.
  const auto rank = [&](Value v) { return std::tuple(is_constant(v), at(v).shared, nodes_.size() - v); };
  if (rank(a) > rank(b)) std::swap(a, b);
  if (is_constant(b, 0.0)) return b;
  if (is_constant(b, 1.0)) return a;
  if (is_constant(b, -1.0)) return negative(a);
  if (is_operation(a, Op::negate))
    return is_constant(b) ? product(at(a).a, constant(-at(b).value)) : negative(product(at(a).a, b));
  if (is_operation(b, Op::negate)) return negative(product(a, at(b).a));
  if (at(b).shared && !at(a).shared && is_operation(a, Op::multiply) && at(at(a).b).shared) {
    const Value collected = product(at(a).b, b);  // (x s) t = x (s t)
    if (!is_constant(collected) || std::isnormal(at(collected).value)) return product(at(a).a, collected);
  }
  return operation(Op::multiply, a, b);
}

TapeBuilder::Value TapeBuilder::quotient(Value a, Value b) {
  if (is_constant(a, 0.0) || is_constant(b, 1.0)) return a;
  if (is_operation(a, Op::negate)) return negative(quotient(at(a).a, b));
  if (is_operation(b, Op::negate)) return negative(quotient(a, at(b).a));
  if (is_constant(b)) {
    int exponent = 0;  // a division by a power of two is exactly a multiplication
    const double reciprocal = 1.0 / at(b).value;
    if (std::abs(std::frexp(at(b).value, &exponent)) == 0.5 && std::isnormal(reciprocal))
      return product(a, constant(reciprocal));
  }
  return operation(Op::divide, a, b);
}

/// x^n by repeated squaring: relative error at most (n-1)u to first order, u = 2^-53.
TapeBuilder::Value TapeBuilder::positive_integer_power(Value a, unsigned n) {
  Value square = a, result = a;
  bool started = false;
  for (;; square = product(square, square)) {
    if (n & 1u) {
      result = started ? product(result, square) : square;
      started = true;
    }
    if ((n >>= 1) == 0) return result;
  }
}

TapeBuilder::Value TapeBuilder::power(Value a, Value b) {
  constexpr double largest = 16;
  if (is_constant(a, 1.0)) return a;
  if (!is_constant(b)) return operation(Op::power, a, b);
  const double n = at(b).value, size = std::abs(n), whole = std::floor(size);
  if (n == 0.0) return constant(1.0);
  if (!(size <= largest) || (size != whole && size != whole + 0.5)) return operation(Op::power, a, b);
  Value result = a;
  if (whole > 0) result = positive_integer_power(a, static_cast<unsigned>(whole));
  if (size != whole) {
    const Value root = unary(Op::square_root, a);
    result = whole > 0 ? product(result, root) : root;
  }
  return n > 0 ? result : quotient(constant(1.0), result);
}

}  // namespace wienertree
