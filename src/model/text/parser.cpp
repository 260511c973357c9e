#include <cln/cln.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

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
constexpr int largest_exponent = 1000;
constexpr int largest_number_bits = 8192;  // beyond this an exact number is replaced by the nearest double
constexpr std::size_t longest_literal = 400;
constexpr std::size_t most_observations = 1000;

numeric exact(double value) { return numeric(cln::cl_N(cln::rational(cln::cl_DF(value)))); }

int bits(const numeric& n) { return n.numer().int_length() + n.denom().int_length(); }

// Largest numeric exponent in a power or product.
bool exponent_too_large(const ex& e) {
  if (is_exactly_a<GiNaC::power>(e))
    return is_exactly_a<numeric>(e.op(1)) && GiNaC::abs(ex_to<numeric>(e.op(1))) > numeric(largest_exponent);
  if (!is_exactly_a<GiNaC::mul>(e)) return false;
  for (const ex& factor : e)
    if (exponent_too_large(factor)) return true;
  return false;
}

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
    } catch (const Error&) {
      throw;
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
      factors.push_back(operation.is('/') ? raised(factor, -1, operation) : factor);
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
    return raised(base, signed_factor(), operation);
  }

  ex raised(const ex& base, const ex& exponent, const Token& token) const {
    if (is_exactly_a<numeric>(exponent)) {
      const numeric& n = ex_to<numeric>(exponent);
      const bool large = GiNaC::abs(n) > numeric(largest_exponent);
      if (is_exactly_a<numeric>(base)) {
        const numeric& b = ex_to<numeric>(base);
        if (b.is_negative() && !n.is_integer()) fail("power of a negative number is not real", token);
        if (b.is_zero() && n.is_negative()) fail("division by zero", token);
        const double value = std::pow(b.to_double(), n.to_double());
        if (!std::isfinite(value)) fail("power is not finite", token, fmt::format("{}", value));
        if (large || (n.is_integer() && bits(b) * std::abs(n.to_int()) > largest_number_bits))
          return exact(value);
      } else if (large) {
        fail(fmt::format("exponent larger than {}", largest_exponent), token,
             fmt::format("{}", n.to_double()));
      }
    }
    const ex result = algebra(token, [&] { return GiNaC::power(base, exponent).eval(); });
    if (exponent_too_large(result)) fail(fmt::format("exponent larger than {}", largest_exponent), token);
    return result;
  }

  ex primary() {
    const Token token = next();
    if (token.kind == Token::Kind::number) return literal(take());
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

  // Decimal numbers are kept exactly, as fractions, so that what cancels on paper cancels here.
  ex literal(const Token& token) const {
    const std::string text(token.text);
    if (text.size() > longest_literal)
      fail(fmt::format("number of more than {} digits", longest_literal), token);
    const double value = std::strtod(text.c_str(), nullptr);
    std::string digits;
    long exponent = 0;
    std::size_t i = 0;
    for (bool fraction = false; i < text.size() && text[i] != 'e' && text[i] != 'E'; ++i) {
      if (text[i] == '.') {
        fraction = true;
        continue;
      }
      digits += text[i];
      if (fraction) --exponent;
    }
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
    if (digits.empty()) return 0;
    if (!std::isnormal(value)) fail("number out of the range of double precision", token, text);
    if (i < text.size()) exponent += std::strtol(text.c_str() + i + 1, nullptr, 10);
    return numeric(digits.c_str()) * numeric(10).power(numeric(exponent));
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
    return applied(*function, arguments, name);
  }

  ex applied(const FunctionName& function, const std::vector<ex>& arguments, const Token& name) const {
    if (is_exactly_a<numeric>(arguments[0])) {
      const numeric& x = ex_to<numeric>(arguments[0]);
      if (function.op == Op::logarithm && !x.is_positive())
        fail("log of a number that is not positive", name, fmt::format("{}", x.to_double()));
      if (function.op == Op::square_root && x.is_negative())
        fail("sqrt of a negative number", name, fmt::format("{}", x.to_double()));
    }
    return algebra(name, [&] { return apply_symbolically(function.op, arguments); });
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
