#include "wienertree/model/text/checked_algebra.hpp"

#include <cln/cln.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "wienertree/model/text/function_names.hpp"

namespace wienertree::text {

namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_exactly_a;
using GiNaC::numeric;

constexpr int largest_exponent = 1000;
constexpr int largest_number_bits = 8192;
constexpr std::size_t longest_literal = 400;

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

// The power of two numbers: exact when that is not too long.
ex raised_number(const numeric& base, const numeric& n) {
  if (base.is_negative() && !n.is_integer()) throw AlgebraError("power of a negative number is not real");
  if (base.is_zero() && n.is_negative()) throw AlgebraError("division by zero");
  const double value = std::pow(base.to_double(), n.to_double());
  if (!std::isfinite(value)) throw AlgebraError("power is not finite", fmt::format("{}", value));
  const bool large = GiNaC::abs(n) > numeric(largest_exponent);
  if (large || (n.is_integer() && bits(base) * std::abs(n.to_int()) > largest_number_bits))
    return exact(value);
  return GiNaC::power(base, n).eval();
}

}  // namespace

ex exact_number(std::string_view literal) {
  if (literal.size() > longest_literal)
    throw AlgebraError(fmt::format("number of more than {} digits", longest_literal));
  const std::string text(literal);
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
  if (!std::isnormal(value)) throw AlgebraError("number out of the range of double precision", text);
  if (i < text.size()) exponent += std::strtol(text.c_str() + i + 1, nullptr, 10);
  return numeric(digits.c_str()) * numeric(10).power(numeric(exponent));
}

ex raised(const ex& base, const ex& exponent) {
  const std::string too_large = fmt::format("exponent larger than {}", largest_exponent);
  if (is_exactly_a<numeric>(exponent)) {
    const numeric& n = ex_to<numeric>(exponent);
    if (is_exactly_a<numeric>(base)) return raised_number(ex_to<numeric>(base), n);
    if (GiNaC::abs(n) > numeric(largest_exponent))
      throw AlgebraError(too_large, fmt::format("{}", n.to_double()));
  }
  const ex result = GiNaC::power(base, exponent).eval();
  if (exponent_too_large(result)) throw AlgebraError(too_large);
  return result;
}

ex applied(Op function, const std::vector<ex>& arguments) {
  if (is_exactly_a<numeric>(arguments.at(0))) {
    const numeric& x = ex_to<numeric>(arguments[0]);
    if (function == Op::logarithm && !x.is_positive())
      throw AlgebraError("log of a number that is not positive", fmt::format("{}", x.to_double()));
    if (function == Op::square_root && x.is_negative())
      throw AlgebraError("sqrt of a negative number", fmt::format("{}", x.to_double()));
  }
  const ex result = apply_symbolically(function, arguments);
  // Of numbers GiNaC gives asin(2) and the like as complex numbers.
  if (is_exactly_a<numeric>(result) && !ex_to<numeric>(result).is_real())
    throw AlgebraError(fmt::format("{} has no real value here", function_name(function)));
  return result;
}

}  // namespace wienertree::text
