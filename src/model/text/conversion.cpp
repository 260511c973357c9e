#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_exactly_a;
using GiNaC::numeric;

namespace {

// Integers and short fractions are printed as such, short decimals as decimals, the rest as the nearest
// double.
std::string printed(const numeric& value, double approximation) {
  const std::string decimal = fmt::format("{}", approximation);
  if (!value.is_rational() || value.is_integer() || decimal.size() <= 6) return decimal;
  const numeric numerator = value.numer(), denominator = value.denom();
  constexpr int bits_of_four_digits = 13;
  if (numerator.int_length() > bits_of_four_digits || denominator.int_length() > bits_of_four_digits)
    return decimal;
  return fmt::format("{}/{}", numerator.to_int(), denominator.to_int());
}

}  // namespace

Expression Conversion::number(const numeric& value) {
  if (!value.is_real()) throw std::domain_error("not a real number");
  const double approximation = value.to_double();
  return arena_.number(approximation, printed(value, approximation));
}

Expression Conversion::operator()(const ex& e) { return joined(scaled(e)); }

Expression Conversion::joined(const Scaled& s) {
  if (s.rest == nullptr || s.coefficient.is_zero()) return number(s.coefficient);
  if (s.coefficient.is_equal(1)) return s.rest;
  std::vector<Expression> factors{number(s.coefficient)};
  if (s.rest->kind == Node::Kind::product)
    factors.insert(factors.end(), s.rest->operands.begin(), s.rest->operands.end());
  else
    factors.push_back(s.rest);
  return arena_.product(std::move(factors));
}

Conversion::Scaled Conversion::scaled(const ex& e) {
  if (const auto found = done_.find(e); found != done_.end()) return found->second;
  const Scaled result = make_scaled(e);
  done_.emplace(e, result);
  return result;
}

Conversion::Scaled Conversion::make_scaled(const ex& e) {
  if (is_exactly_a<numeric>(e)) return {ex_to<numeric>(e), nullptr};
  if (e.is_equal(GiNaC::Pi)) return {1, arena_.pi()};
  if (GiNaC::is_a<GiNaC::symbol>(e)) {
    const Symbols::Entry& entry = symbols_.entry(ex_to<GiNaC::symbol>(e));
    return {1, arena_.symbol(entry.role, entry.index, entry.name)};
  }
  if (is_exactly_a<GiNaC::function>(e)) {
    std::vector<Expression> arguments;
    for (const ex& argument : e) arguments.push_back((*this)(argument));
    return {1, arena_.function(operation(ex_to<GiNaC::function>(e)), std::move(arguments))};
  }
  if (is_exactly_a<GiNaC::power>(e)) return scaled_power(e.op(0), e.op(1));
  if (is_exactly_a<GiNaC::mul>(e)) return scaled_product(e);
  if (is_exactly_a<GiNaC::add>(e)) {
    std::vector<Expression> parts;
    for (const Scaled& term : terms(e)) parts.push_back(joined(term));
    return {1, arena_.sum(std::move(parts))};
  }
  throw std::domain_error("not a real elementary expression");
}

Conversion::Scaled Conversion::scaled_power(const ex& base, const ex& exponent) {
  if (is_exactly_a<GiNaC::add>(base) && is_exactly_a<numeric>(exponent) &&
      ex_to<numeric>(exponent).is_integer()) {
    const Scaled primitive = primitive_part(base);
    const numeric& n = ex_to<numeric>(exponent);
    return {primitive.coefficient.power(n),
            n.is_equal(1) ? primitive.rest : arena_.power(primitive.rest, number(n))};
  }
  return {1, arena_.power((*this)(base), (*this)(exponent))};
}

Conversion::Scaled Conversion::scaled_product(const ex& e) {
  numeric coefficient = 1;
  std::vector<Expression> factors;
  for (const ex& factor : e) {
    const Scaled s = is_exactly_a<GiNaC::add>(factor) ? scaled_power(factor, 1) : scaled(factor);
    coefficient = coefficient * s.coefficient;
    if (s.rest == nullptr) continue;
    if (s.rest->kind == Node::Kind::product)
      factors.insert(factors.end(), s.rest->operands.begin(), s.rest->operands.end());
    else
      factors.push_back(s.rest);
  }
  return {coefficient, factors.empty() ? nullptr : arena_.product(std::move(factors))};
}

std::vector<Conversion::Scaled> Conversion::terms(const ex& sum) {
  std::vector<Scaled> result;
  for (const ex& term : sum) result.push_back(scaled(term));
  return result;
}

// sum = content * primitive part; the latter has coprime integer coefficients where they are rational, and a
// positive one in front.
Conversion::Scaled Conversion::primitive_part(const ex& sum) {
  std::vector<Scaled> parts = terms(sum);
  std::sort(parts.begin(), parts.end(), [](const Scaled& a, const Scaled& b) {
    if (a.rest == nullptr || b.rest == nullptr) return a.rest == nullptr && b.rest != nullptr;
    return compare(a.rest, b.rest) < 0;
  });
  numeric numerators = 0, denominators = 1;
  for (const Scaled& part : parts) {
    if (!part.coefficient.is_rational()) throw std::domain_error("not a real number");
    numerators = GiNaC::gcd(numerators, part.coefficient.numer());
    denominators = GiNaC::lcm(denominators, part.coefficient.denom());
  }
  numeric content = numerators / denominators;
  if (parts.front().coefficient.is_negative()) content = content * numeric(-1);
  std::vector<Expression> primitive;
  for (const Scaled& part : parts) primitive.push_back(joined({part.coefficient / content, part.rest}));
  return {content, arena_.sum(std::move(primitive))};
}

}  // namespace wienertree::text
