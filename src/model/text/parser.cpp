#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "wienertree/model/text/checked_algebra.hpp"
#include "wienertree/model/text/function_names.hpp"
#include "wienertree/model/text/lexer.hpp"
#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_exactly_a;
using GiNaC::numeric;

constexpr std::size_t deepest_nesting = 200;
constexpr std::size_t most_observations = 1000;

// "y12" -> 11; npos when `name` is not a component of y.
std::size_t observation_index(std::string_view name) {
  if (name.size() < 2 || name.size() > 5 || name[0] != 'y' || name[1] == '0') return std::string_view::npos;
  std::size_t index = 0;
  for (const char c : name.substr(1)) {
    if (c < '0' || c > '9') return std::string_view::npos;
    index = 10 * index + static_cast<std::size_t>(c - '0');
  }
  return index <= most_observations ? index - 1 : std::string_view::npos;
}

class Parser {
 public:
  Parser(const SourceExpression& source, const Scope& scope)
      : source_(source), scope_(scope), tokens_(tokens(source)) {}

  ex whole() {
    if (next().kind == Token::Kind::end) fail("empty expression", next());
    const ex result = disjunction();
    if (next().kind != Token::Kind::end) fail_unexpected();
    return result;
  }

 private:
  const Token& next() const { return tokens_[position_]; }
  Token take() { return tokens_[position_++]; }

  [[noreturn]] void fail(const std::string& message, const Token& token, std::string value = {}) const {
    throw InputError(message, source_.at(token.offset).text(), std::move(value));
  }
  [[noreturn]] void fail_unexpected() const {
    const Token& token = next();
    if (token.kind == Token::Kind::end) fail("the expression ends too early", token);
    if (token.is('*') && position_ > 0 && tokens_[position_ - 1].is('*'))
      fail("unexpected '*'; a power is written with '^'", token);
    if (token.is(')')) fail("unexpected ')'", token);
    const bool operand = token.kind != Token::Kind::sign || token.is('(');
    fail(operand && position_ > 0 ? "missing operator; a product needs its '*'" : "unexpected symbol", token,
         std::string(token.text));
  }

  // Runs a piece of algebra; what GiNaC refuses becomes an error at `token`.
  template <class F>
  ex algebra(const Token& token, F&& f) const {
    try {
      return f();
    } catch (const AlgebraError& error) {
      fail(error.what(), token, error.value);
    } catch (const std::exception& error) {
      fail(std::string_view(error.what()).find("zero") != std::string_view::npos
               ? "division by zero"
               : "the expression has no finite value here",
           token, source_.text.size() <= 80 ? source_.text : std::string(token.text));
    }
  }

  class Nesting {
   public:
    explicit Nesting(Parser& parser) : parser_(parser) {
      if (++parser_.depth_ > deepest_nesting)
        parser_.fail(fmt::format("expression nested deeper than {} levels", deepest_nesting), parser_.next());
    }
    ~Nesting() { --parser_.depth_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;

   private:
    Parser& parser_;
  };

  // a or b = 1 - (1 - a)(1 - b)
  ex disjunction() {
    const Token first = next();
    ex result = conjunction();
    while (next().is_word("or")) {
      const Token word = take();
      require_condition(result, first, word);
      const Token second = next();
      const ex other = conjunction();
      require_condition(other, second, word);
      result = condition(algebra(word, [&] { return ex(1 - (1 - result) * (1 - other)); }));
    }
    return result;
  }

  ex conjunction() {
    const Token first = next();
    ex result = negation();
    while (next().is_word("and")) {
      const Token word = take();
      require_condition(result, first, word);
      const Token second = next();
      const ex other = negation();
      require_condition(other, second, word);
      result = condition(algebra(word, [&] { return ex(result * other); }));
    }
    return result;
  }

  ex negation() {
    if (!next().is_word("not")) return comparison();
    const Nesting nesting(*this);
    const Token word = take();
    const Token operand = next();
    const ex result = negation();
    require_condition(result, operand, word);
    return condition(1 - result);
  }

  // Remembers that `e` is 0 or 1.
  const ex& condition(const ex& e) { return *conditions_.insert(e).first; }

  void require_condition(const ex& e, const Token& place, const Token& word) const {
    if (!conditions_.contains(e) && !e.is_zero() && !e.is_equal(1))
      fail(fmt::format("'{}' is for comparisons, such as x > 1", word.text), place, std::string(place.text));
  }

  // a > b is step(a - b), a >= b is 1 - step(b - a).
  ex comparison() {
    const ex left = sum();
    const auto is_comparison = [&] {
      return next().kind == Token::Kind::sign && (next().text[0] == '<' || next().text[0] == '>');
    };
    if (!is_comparison()) return left;
    const Token sign = take();
    const ex right = sum();
    if (is_comparison()) fail("comparisons do not chain; join two of them with 'and'", next());
    return condition(algebra(sign, [&]() -> ex {
      const bool greater = sign.text[0] == '>', or_equal = sign.text.size() == 2;
      const ex difference = greater != or_equal ? left - right : right - left;
      const ex strict = apply_symbolically(Op::step, {difference});
      return or_equal ? 1 - strict : strict;
    }));
  }

  ex sum() {
    const Token first = next();
    GiNaC::exvector terms{product()};
    while (next().is('+') || next().is('-')) {
      const bool minus = take().is('-');
      const ex term = product();
      terms.push_back(minus ? -term : term);
    }
    return terms.size() == 1 ? terms[0] : algebra(first, [&] { return ex(GiNaC::add(terms)); });
  }

  ex product() {
    const Token first = next();
    GiNaC::exvector factors{signed_factor()};
    while (next().is('*') || next().is('/')) {
      const Token operation = take();
      const ex factor = signed_factor();
      factors.push_back(operation.is('/') ? raised_at(operation, factor, -1) : factor);
    }
    return factors.size() == 1 ? factors[0] : algebra(first, [&] { return ex(GiNaC::mul(factors)); });
  }

  ex signed_factor() {
    const Nesting nesting(*this);
    if (next().is('-')) {
      take();
      return -signed_factor();
    }
    if (next().is('+')) {
      take();
      return signed_factor();
    }
    const ex base = primary();
    if (!next().is('^')) return base;
    const Token operation = take();
    return raised_at(operation, base, signed_factor());
  }

  ex raised_at(const Token& operation, const ex& base, const ex& exponent) const {
    return algebra(operation, [&] { return raised(base, exponent); });
  }

  ex primary() {
    const Token token = next();
    if (token.kind == Token::Kind::number) {
      take();
      return algebra(token, [&] { return exact_number(token.text); });
    }
    if (token.kind == Token::Kind::name) {
      const auto is_reserved = [&](std::string_view word) { return token.is_word(word) && word != "if"; };
      if (std::any_of(reserved_words.begin(), reserved_words.end(), is_reserved))
        fail(fmt::format("'{}' stands between two conditions, or before one", token.text), token);
      take();
      return next().is('(') ? call(token) : named(token);
    }
    if (!token.is('(')) fail_unexpected();
    take();
    const ex inner = disjunction();
    close(token);
    return inner;
  }

  void close(const Token& opening) {
    if (next().kind == Token::Kind::end) fail("missing ')' for this '('", opening);
    if (!next().is(')')) fail_unexpected();
    take();
  }

  std::vector<ex> call_arguments() {
    const Token opening = take();
    std::vector<ex> arguments;
    if (!next().is(')')) {
      arguments.push_back(disjunction());
      while (next().is(',')) {
        take();
        arguments.push_back(disjunction());
      }
    }
    close(opening);
    return arguments;
  }

  ex choice(const Token& name) {
    const std::vector<ex> arguments = call_arguments();
    if (arguments.size() != 3)
      fail(fmt::format("if takes 3 arguments, a condition and two values, not {}", arguments.size()), name);
    return algebra(name, [&]() -> ex {
      return apply_symbolically(Op::where, {arguments[0], arguments[1]}) +
             apply_symbolically(Op::unless, {arguments[0], arguments[2]});
    });
  }

  ex call(const Token& name) {
    if (name.text == "if") return choice(name);
    const FunctionName* function = nullptr;
    for (const FunctionName& candidate : function_names)
      if (candidate.name == name.text) function = &candidate;
    if (function == nullptr) {
      if (is_declared(name.text))
        fail(fmt::format("'{}' is not a function; a product needs its '*'", name.text), name);
      std::vector<std::string> known;
      for (const FunctionName& candidate : function_names) known.emplace_back(candidate.name);
      known.emplace_back("if");
      fail(fmt::format("unknown function{}; there are {}", suggestion(name.text, known),
                       fmt::join(known, " ")),
           name, std::string(name.text));
    }
    const std::vector<ex> arguments = call_arguments();
    if (arguments.size() != function->arguments)
      fail(fmt::format("{} takes {} argument{}, not {}", function->name, function->arguments,
                       function->arguments == 1 ? "" : "s", arguments.size()),
           name);
    return algebra(name, [&] { return applied(function->op, arguments); });
  }

  bool is_declared(std::string_view name) const {
    return name == "pi" || scope_.symbols.find(name) != nullptr;
  }

  ex named(const Token& token) const {
    if (token.text == "pi") return GiNaC::Pi;
    if (scope_.observations) {
      const std::size_t index = observation_index(token.text);
      if (index != std::string_view::npos) return scope_.symbols.observation(index);
    }
    const Symbols::Entry* entry = scope_.symbols.find(token.text);
    if (entry == nullptr) fail_unknown(token);
    if (entry->role != Role::parameter && !scope_.states)
      fail(fmt::format("{} cannot be used here, only numbers and parameters can",
                       entry->role == Role::input ? "an input"
                       : entry->name == "t"       ? "time"
                                                  : "a state"),
           token, entry->name);
    if (entry->role == Role::parameter && entry->index >= scope_.parameters)
      fail("a parameter may refer to earlier parameters only", token, entry->name);
    return entry->symbol;
  }

  [[noreturn]] void fail_unknown(const Token& token) const {
    std::vector<std::string> known{"pi"};
    for (const FunctionName& function : function_names) {
      if (function.name == token.text)
        fail(fmt::format("the function {} needs its argument in parentheses", token.text), token);
      known.emplace_back(function.name);
    }
    for (const Symbols::Entry& entry : scope_.symbols.entries())
      if (entry.role == Role::parameter ? entry.index < scope_.parameters
                                        : scope_.states && is_identifier(entry.name))
        known.push_back(entry.name);
    fail("unknown name" + suggestion(token.text, known), token, std::string(token.text.substr(0, 80)));
  }

  const SourceExpression& source_;
  const Scope& scope_;
  std::vector<Token> tokens_;
  std::set<ex, GiNaC::ex_is_less> conditions_;  // parts that are 0 or 1
  std::size_t position_ = 0, depth_ = 0;
};

}  // namespace

ex parse(const SourceExpression& source, const Scope& scope) { return Parser(source, scope).whole(); }

}  // namespace wienertree::text
