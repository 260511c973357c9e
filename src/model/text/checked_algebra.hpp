#pragma once
/// The algebra of the parser: GiNaC's, with a limit to the size of numbers and with errors a user can read.
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

/// What is wrong, and the offending value (may be empty).
struct AlgebraError : std::runtime_error {
  explicit AlgebraError(const std::string& message, std::string offending = {})
      : std::runtime_error(message), value(std::move(offending)) {}
  std::string value;
};

/// A decimal number, kept exactly, as a fraction, so that what cancels on paper cancels here.
/// @throws AlgebraError outside the range of double precision
GiNaC::ex exact_number(std::string_view literal);

/// base^exponent. Numbers beyond some thousand bits are replaced by the nearest double.
/// @throws AlgebraError for a division by zero, a power that is not real or not finite, an exponent beyond
/// 1000
GiNaC::ex raised(const GiNaC::ex& base, const GiNaC::ex& exponent);

/// A function of the language. @throws AlgebraError for log and sqrt of numbers out of their domain;
/// std::exception as GiNaC does for a pole
GiNaC::ex applied(Op function, const std::vector<GiNaC::ex>& arguments);

}  // namespace wienertree::text
