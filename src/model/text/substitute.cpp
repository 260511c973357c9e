#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "wienertree/model/text/expression.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::text {

namespace {

struct InTextOrder {
  bool operator()(Expression a, Expression b) const { return compare(a, b) < 0; }
};

class Substitution {
 public:
  Substitution(std::span<const double> parameters, Arena& arena, const std::string& where)
      : parameters_(parameters), arena_(arena), where_(where) {}

  Expression operator()(Expression e) {
    if (const auto found = done_.find(e); found != done_.end()) return found->second;
    const Expression result = simplify(e);
    if (result->is_number() && !std::isfinite(result->number))
      throw InputError("this part of the expression has no finite value", where_, print(e));
    done_.emplace(e, result);
    return result;
  }

 private:
  Expression simplify(Expression e) {
    switch (e->kind) {
      case Node::Kind::number:
        return arena_.number(e->number);
      case Node::Kind::pi:
        return arena_.number(std::numbers::pi);
      case Node::Kind::symbol:
        return e->role == Role::parameter ? arena_.number(parameters_[e->index])
                                          : arena_.symbol(e->role, e->index, e->name);
      case Node::Kind::power:
        return power((*this)(e->operands[0]), (*this)(e->operands[1]));
      case Node::Kind::function:
        return function(e->op, e->operands);
      case Node::Kind::product:
        return product(e->operands);
      case Node::Kind::sum:
        return sum(e->operands);
    }
    return nullptr;
  }

  Expression function(Op op, const std::vector<Expression>& operands) {
    std::vector<Expression> arguments;
    for (Expression operand : operands) arguments.push_back((*this)(operand));
    const bool one = arguments.size() == 1;
    if (arguments[0]->is_number() && (one || arguments[1]->is_number()))
      return arena_.number(apply(op, arguments[0]->number, one ? 0.0 : arguments[1]->number));
    return arena_.function(op, std::move(arguments));
  }

  Expression power(Expression base, Expression exponent) {
    if (exponent->is_number(0) || base->is_number(1)) return arena_.number(1);
    if (exponent->is_number(1)) return base;
    if (base->is_number() && exponent->is_number()) {
      // A square root is rounded correctly, a power need not be.
      return arena_.number(exponent->number == 0.5 ? std::sqrt(base->number)
                                                   : std::pow(base->number, exponent->number));
    }
    // (b^m)^n = b^(m n) holds for real b when n is an integer.
    if (base->kind == Node::Kind::power && base->operands[1]->is_number() && exponent->is_number() &&
        std::trunc(exponent->number) == exponent->number)
      return power(base->operands[0], arena_.number(base->operands[1]->number * exponent->number));
    return arena_.power(base, exponent);
  }

  // The coefficient and, base by base, the exponent where it is a number.
  struct Factors {
    double coefficient = 1;
    std::map<Expression, double, InTextOrder> powers;
    std::vector<Expression> others;
  };

  void collect(Expression factor, Factors& factors) const {
    if (factor->is_number())
      factors.coefficient *= factor->number;
    else if (factor->kind == Node::Kind::product)
      for (Expression part : factor->operands) collect(part, factors);
    else if (factor->kind == Node::Kind::power && factor->operands[1]->is_number())
      factors.powers[factor->operands[0]] += factor->operands[1]->number;
    else if (factor->kind == Node::Kind::power)
      factors.others.push_back(factor);
    else
      factors.powers[factor] += 1;
  }

  Expression product(const std::vector<Expression>& operands) {
    Factors factors;
    for (Expression operand : operands) collect((*this)(operand), factors);
    if (factors.coefficient == 0) return arena_.number(0);
    std::vector<Expression> result = std::move(factors.others);
    for (const auto& [base, exponent] : factors.powers)
      if (exponent != 0) result.push_back(exponent == 1 ? base : arena_.power(base, arena_.number(exponent)));
    if (factors.coefficient != 1 || result.empty()) result.push_back(arena_.number(factors.coefficient));
    return arena_.product(std::move(result));
  }

  void collect(double scale, Expression term, std::map<Expression, double, InTextOrder>& terms,
               double& constant) {
    if (term->kind == Node::Kind::sum) {
      for (Expression part : term->operands) collect(scale, part, terms, constant);
      return;
    }
    const Term parts = split(term, arena_);
    if (parts.rest == nullptr)
      constant += scale * parts.coefficient;
    else if (parts.rest->kind == Node::Kind::sum)
      collect(scale * parts.coefficient, parts.rest, terms, constant);
    else
      terms[parts.rest] += scale * parts.coefficient;
  }

  Expression sum(const std::vector<Expression>& operands) {
    std::map<Expression, double, InTextOrder> terms;
    double constant = 0;
    for (Expression operand : operands) collect(1.0, (*this)(operand), terms, constant);
    std::vector<Expression> result;
    if (constant != 0) result.push_back(arena_.number(constant));
    for (const auto& [rest, coefficient] : terms) {
      if (coefficient == 0) continue;
      if (coefficient == 1) {
        result.push_back(rest);
        continue;
      }
      std::vector<Expression> factors{arena_.number(coefficient)};
      if (rest->kind == Node::Kind::product)
        factors.insert(factors.end(), rest->operands.begin(), rest->operands.end());
      else
        factors.push_back(rest);
      result.push_back(arena_.product(std::move(factors)));
    }
    return arena_.sum(std::move(result));
  }

  std::span<const double> parameters_;
  Arena& arena_;
  const std::string& where_;
  std::unordered_map<Expression, Expression> done_;
};

}  // namespace

Expression substitute(Expression e, std::span<const double> parameters, Arena& arena,
                      const std::string& where) {
  return Substitution(parameters, arena, where)(e);
}

}  // namespace wienertree::text
