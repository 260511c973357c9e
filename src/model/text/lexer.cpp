#include "wienertree/model/text/lexer.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace wienertree::text {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

// One past the last digit from `i` on.
std::size_t skip_digits(std::string_view s, std::size_t i) {
  while (i < s.size() && is_digit(s[i])) ++i;
  return i;
}

// One past a number that starts at `begin`: digits, a point with digits on at least one side, an exponent.
std::size_t end_of_number(std::string_view s, std::size_t begin) {
  std::size_t i = skip_digits(s, begin);
  if (i < s.size() && s[i] == '.') i = skip_digits(s, i + 1);
  if (i < s.size() && (s[i] == 'e' || s[i] == 'E')) {
    const std::size_t sign = i + 1 < s.size() && (s[i + 1] == '+' || s[i + 1] == '-') ? 1 : 0;
    const std::size_t after = skip_digits(s, i + 1 + sign);
    if (after > i + 1 + sign) i = after;
  }
  return i;
}

// The whole UTF-8 character at `i`, or "\xNN" for a byte that has no glyph.
std::string character_at(std::string_view s, std::size_t i) {
  const auto byte = static_cast<unsigned char>(s[i]);
  if (byte < 0x20 || byte == 0x7F) return fmt::format("\\x{:02x}", byte);
  std::size_t end = i + 1;
  while (end < s.size() && (static_cast<unsigned char>(s[end]) & 0xC0U) == 0x80U) ++end;
  return std::string(s.substr(i, end - i));
}

}  // namespace

bool is_identifier(std::string_view name) {
  return !name.empty() && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [](char c) { return is_letter(c) || is_digit(c); });
}

std::vector<Token> tokens(const SourceExpression& source) {
  const std::string_view s = source.text;
  std::vector<Token> result;
  std::size_t i = 0;
  while (i < s.size()) {
    const char c = s[i];
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
      ++i;
      continue;
    }
    Token token{Token::Kind::sign, {}, i};
    std::size_t end = i + 1;
    if (is_digit(c) || (c == '.' && i + 1 < s.size() && is_digit(s[i + 1]))) {
      token.kind = Token::Kind::number;
      end = end_of_number(s, i);
      if (end < s.size() && (is_letter(s[end]) || s[end] == '.'))
        throw InputError("malformed number (a product needs its '*')", source.at(i).text(),
                         std::string(s.substr(i, std::min<std::size_t>(end + 1 - i, 40))));
    } else if (is_letter(c)) {
      token.kind = Token::Kind::name;
      while (end < s.size() && (is_letter(s[end]) || is_digit(s[end]))) ++end;
    } else if (s.substr(i, 2) == "==" || s.substr(i, 2) == "!=") {
      throw InputError("equality is not part of the language; use <, >, <= and >=", source.at(i).text(),
                       std::string(s.substr(i, 2)));
    } else if ((c == '<' || c == '>') && end < s.size() && s[end] == '=') {
      ++end;
    } else if (std::string_view("+-*/^(),<>").find(c) == std::string_view::npos) {
      throw InputError("unexpected character in an expression", source.at(i).text(), character_at(s, i));
    }
    token.text = s.substr(i, end - i);
    result.push_back(token);
    if (result.size() > longest_expression)
      throw InputError(fmt::format("expression of more than {} symbols", longest_expression),
                       source.location.text());
    i = end;
  }
  result.push_back({Token::Kind::end, {}, s.size()});
  return result;
}

}  // namespace wienertree::text
