#pragma once
/// The words of an expression: numbers, names and the signs + - * / ^ ( ) , < > <= >=
#include <cstddef>
#include <string_view>
#include <vector>

#include "wienertree/model/text/location.hpp"

namespace wienertree::text {

struct Token {
  enum class Kind { number, name, sign, end };
  Kind kind = Kind::end;
  std::string_view text;   ///< part of the expression's text; empty at the end
  std::size_t offset = 0;  ///< of the first character
  /// `sign` of one character; `<=` is not `<`.
  bool is(char sign) const { return kind == Kind::sign && text.size() == 1 && text.front() == sign; }
  bool is_word(std::string_view word) const { return kind == Kind::name && text == word; }
};

/// An expression longer than this is refused.
inline constexpr std::size_t longest_expression = 10000;

/// The tokens, the last of kind `end`. They refer to `source.text`.
/// @throws InputError for a character outside the language, a malformed number, or too many tokens
std::vector<Token> tokens(const SourceExpression& source);

bool is_identifier(std::string_view name);

}  // namespace wienertree::text
