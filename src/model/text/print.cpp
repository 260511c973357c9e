#include <fmt/format.h>

#include <string_view>

#include "wienertree/model/text/expression.hpp"
#include "wienertree/model/text/function_names.hpp"

namespace wienertree::text {

namespace {

// Binding strength of what is printed: a weaker part stands in parentheses.
enum Strength { in_sum, in_product, in_power };

std::string parenthesised_if(bool condition, const std::string& s) {
  return condition ? fmt::format("({})", s) : s;
}

std::string print_at(Expression e, Strength strength);

bool is_negative_number(Expression e) { return e->is_number() && e->number < 0; }

std::string print_power(Expression base, Expression exponent) {
  if (exponent->is_number(1)) return print_at(base, in_power);
  if (exponent->is_number(0.5)) return fmt::format("sqrt({})", print(base));
  const bool simple = exponent->is_number() && exponent->name.find_first_of("-/e") == std::string::npos;
  const bool compound_base = base->kind == Node::Kind::power && !is_negative_number(base->operands[1]);
  return fmt::format("{}^{}", parenthesised_if(compound_base, print_at(base, in_power)),
                     parenthesised_if(!simple && exponent->kind != Node::Kind::symbol, print(exponent)));
}

// Negates a negative number's printed form.
std::string magnitude(const std::string& number) { return number.substr(number.front() == '-' ? 1 : 0); }

// A product without its sign; `negative` tells the sign.
std::string print_product(const std::vector<Expression>& factors, bool& negative) {
  negative = is_negative_number(factors.front());
  std::string above, below;
  std::size_t below_count = 0;
  const auto multiply = [](std::string& product, const std::string& factor) {
    if (!product.empty()) product += '*';
    product += factor;
  };
  for (Expression factor : factors) {
    if (factor->is_number()) {
      if (magnitude(factor->name) != "1") multiply(above, magnitude(factor->name));
    } else if (factor->kind == Node::Kind::power && is_negative_number(factor->operands[1])) {
      Arena arena;
      const Expression exponent = factor->operands[1];
      multiply(below,
               print_power(factor->operands[0], arena.number(-exponent->number, magnitude(exponent->name))));
      ++below_count;
    } else {
      multiply(above, print_at(factor, in_product));
    }
  }
  if (above.empty()) above.push_back('1');
  return below.empty() ? above : fmt::format("{}/{}", above, parenthesised_if(below_count > 1, below));
}

std::string print_sum(const std::vector<Expression>& terms) {
  std::string result;
  for (Expression term : terms) {
    bool negative = false;
    std::string text;
    if (term->kind == Node::Kind::product) {
      text = print_product(term->operands, negative);
    } else if (is_negative_number(term)) {
      negative = true;
      text = magnitude(term->name);
    } else {
      text = print_at(term, in_product);
    }
    if (!result.empty()) result += negative ? " - " : " + ";
    if (result.empty() && negative) result.push_back('-');
    result += text;
  }
  return result;
}

// The form that the parser turns into step(u).
std::string print_step(Expression u) { return fmt::format("({} > 0)", print(u)); }

std::string print_at(Expression e, Strength strength) {
  switch (e->kind) {
    case Node::Kind::number: {
      const bool fraction = e->name.find('/') != std::string::npos;
      return parenthesised_if(strength != in_sum && (e->number < 0 || (fraction && strength == in_power)),
                              e->name);
    }
    case Node::Kind::pi:
      return "pi";
    case Node::Kind::symbol:
      return e->name;
    case Node::Kind::power: {
      if (!is_negative_number(e->operands[1])) return print_power(e->operands[0], e->operands[1]);
      bool negative = false;
      return parenthesised_if(strength == in_power, print_product({e}, negative));
    }
    case Node::Kind::function: {
      if (e->op == Op::step) return print_step(e->operands[0]);
      if (e->op == Op::where)
        return fmt::format("if({}, {}, 0)", print(e->operands[0]), print(e->operands[1]));
      if (e->op == Op::unless)
        return fmt::format("if({}, 0, {})", print(e->operands[0]), print(e->operands[1]));
      std::string arguments = print(e->operands[0]);
      for (std::size_t i = 1; i < e->operands.size(); ++i)
        arguments += fmt::format(", {}", print(e->operands[i]));
      return fmt::format("{}({})", function_name(e->op), arguments);
    }
    case Node::Kind::product: {
      bool negative = false;
      const std::string text = print_product(e->operands, negative);
      return parenthesised_if(strength == in_power || (negative && strength == in_product),
                              fmt::format("{}{}", negative ? "-" : "", text));
    }
    case Node::Kind::sum:
      return parenthesised_if(strength != in_sum, print_sum(e->operands));
  }
  return {};
}

}  // namespace

std::string print(Expression e) { return print_at(e, in_sum); }

}  // namespace wienertree::text
