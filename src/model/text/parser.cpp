#include <fmt/format.h>

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
    const ex result = sum();
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
      take();
      return next().is('(') ? call(token) : named(token);
    }
    if (!token.is('(')) fail_unexpected();
    take();
    const ex inner = sum();
    close(token);
    return inner;
  }

  void close(const Token& opening) {
    if (next().kind == Token::Kind::end) fail("missing ')' for this '('", opening);
    if (!next().is(')')) fail_unexpected();
    take();
  }

  ex call(const Token& name) {
    const FunctionName* function = nullptr;
    for (const FunctionName& candidate : function_names)
      if (candidate.name == name.text) function = &candidate;
    if (function == nullptr) {
      if (is_declared(name.text))
        fail(fmt::format("'{}' is not a function; a product needs its '*'", name.text), name);
      std::vector<std::string> known;
      for (const FunctionName& candidate : function_names) known.emplace_back(candidate.name);
      fail("unknown function" + suggestion(name.text, known), name, std::string(name.text));
    }
    const Token opening = take();
    std::vector<ex> arguments;
    if (!next().is(')')) {
      arguments.push_back(sum());
      while (next().is(',')) {
        take();
        arguments.push_back(sum());
      }
    }
    close(opening);
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
    if (entry->role == Role::state && !scope_.states)
      fail(fmt::format("{} cannot be used here, only numbers and parameters can",
                       entry->name == "t" ? "time" : "a state"),
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
      if (entry.role == Role::state ? scope_.states : entry.index < scope_.parameters)
        known.push_back(entry.name);
    fail("unknown name" + suggestion(token.text, known), token, std::string(token.text.substr(0, 80)));
  }

  const SourceExpression& source_;
  const Scope& scope_;
  std::vector<Token> tokens_;
  std::size_t position_ = 0, depth_ = 0;
};

}  // namespace

ex parse(const SourceExpression& source, const Scope& scope) { return Parser(source, scope).whole(); }

}  // namespace wienertree::text
