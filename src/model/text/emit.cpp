#include <unordered_map>

#include "wienertree/model/text/expression.hpp"

namespace wienertree::text {

namespace {

class Emission {
 public:
  Emission(const TapeSymbols& symbols, TapeBuilder& builder, ZeroLogZero zero_log_zero)
      : symbols_(symbols), builder_(builder), zero_log_zero_(zero_log_zero) {}

  TapeBuilder::Value operator()(Expression e) {
    if (const auto found = done_.find(e); found != done_.end()) return found->second;
    const TapeBuilder::Value value = make(e);
    done_.emplace(e, value);
    return value;
  }

 private:
  TapeBuilder::Value make(Expression e) {
    switch (e->kind) {
      case Node::Kind::symbol:
        if (e->role == Role::input) return symbols_.inputs.at(e->index);
        return e->role == Role::state ? symbols_.states.at(e->index) : symbols_.observations.at(e->index);
      case Node::Kind::power:
        return builder_.binary(Op::power, (*this)(e->operands[0]), (*this)(e->operands[1]));
      case Node::Kind::function:
        return is_binary(e->op) ? builder_.binary(e->op, (*this)(e->operands[0]), (*this)(e->operands[1]))
                                : builder_.unary(e->op, (*this)(e->operands[0]));
      case Node::Kind::product:
        if (zero_log_zero_ == ZeroLogZero::zero) return limit_of_product(e->operands);
        return fold(Op::multiply, e->operands);
      case Node::Kind::sum:
        return fold(Op::add, e->operands);
      case Node::Kind::number:
      case Node::Kind::pi:
        break;
    }
    return builder_.constant(e->number);
  }

  // r log(u) as where(r, r log(u)): 0 where r is 0.
  TapeBuilder::Value limit_of_product(const std::vector<Expression>& factors) {
    std::vector<Expression> logarithms, others;
    for (Expression factor : factors) {
      const bool is_log = factor->kind == Node::Kind::function && factor->op == Op::logarithm;
      (is_log ? logarithms : others).push_back(factor);
    }
    if (logarithms.empty() || others.empty()) return fold(Op::multiply, factors);
    const TapeBuilder::Value rest = fold(Op::multiply, others);
    const TapeBuilder::Value product = builder_.binary(Op::multiply, rest, fold(Op::multiply, logarithms));
    return builder_.binary(Op::where, rest, product);
  }

  TapeBuilder::Value fold(Op op, const std::vector<Expression>& operands) {
    TapeBuilder::Value result = (*this)(operands[0]);
    for (std::size_t i = 1; i < operands.size(); ++i)
      result = builder_.binary(op, result, (*this)(operands[i]));
    return result;
  }

  const TapeSymbols& symbols_;
  TapeBuilder& builder_;
  ZeroLogZero zero_log_zero_;
  std::unordered_map<Expression, TapeBuilder::Value> done_;
};

}  // namespace

TapeBuilder::Value emit(Expression e, const TapeSymbols& symbols, TapeBuilder& builder,
                        ZeroLogZero zero_log_zero) {
  return Emission(symbols, builder, zero_log_zero)(e);
}

}  // namespace wienertree::text
