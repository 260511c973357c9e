#include <unordered_map>

#include "wienertree/model/text/expression.hpp"

namespace wienertree::text {

namespace {

class Emission {
 public:
  Emission(const TapeSymbols& symbols, TapeBuilder& builder) : symbols_(symbols), builder_(builder) {}

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
        return e->role == Role::state ? symbols_.states.at(e->index) : symbols_.observations.at(e->index);
      case Node::Kind::power:
        return builder_.binary(Op::power, (*this)(e->operands[0]), (*this)(e->operands[1]));
      case Node::Kind::function:
        return is_binary(e->op) ? builder_.binary(e->op, (*this)(e->operands[0]), (*this)(e->operands[1]))
                                : builder_.unary(e->op, (*this)(e->operands[0]));
      case Node::Kind::product:
        return fold(Op::multiply, e->operands);
      case Node::Kind::sum:
        return fold(Op::add, e->operands);
      case Node::Kind::number:
      case Node::Kind::pi:
        break;
    }
    return builder_.constant(e->number);
  }

  TapeBuilder::Value fold(Op op, const std::vector<Expression>& operands) {
    TapeBuilder::Value result = (*this)(operands[0]);
    for (std::size_t i = 1; i < operands.size(); ++i)
      result = builder_.binary(op, result, (*this)(operands[i]));
    return result;
  }

  const TapeSymbols& symbols_;
  TapeBuilder& builder_;
  std::unordered_map<Expression, TapeBuilder::Value> done_;
};

}  // namespace

TapeBuilder::Value emit(Expression e, const TapeSymbols& symbols, TapeBuilder& builder) {
  return Emission(symbols, builder)(e);
}

}  // namespace wienertree::text
