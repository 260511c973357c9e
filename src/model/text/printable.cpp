#include "wienertree/model/text/printable.hpp"

#include <fmt/format.h>

#include <cstdint>

namespace wienertree::text {
namespace {

constexpr char32_t no_character = 0xFFFFFFFF;

struct Character {
  char32_t code = no_character;  ///< no_character: these bytes are not UTF-8
  std::size_t bytes = 1;
};

// The character at the front of a text that is not empty. Overlong forms and surrogates are not UTF-8.
Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  char32_t code = lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  if (overlong || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {code, bytes};
}

bool is_line_end_or_tab(char32_t c) { return c == '\n' || c == '\r' || c == '\t'; }

bool is_printable(char32_t c) {
  if (c < 0x20 || (c >= 0x7F && c <= 0x9F)) return false;
  if ((c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069)) return false;
  return c != 0xFFFE && c != 0xFFFF && c != no_character;
}

}  // namespace

std::string printable(std::string_view text, LineEnds line_ends) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character c = first_character(text);
    if (is_printable(c.code) || (line_ends == LineEnds::kept && is_line_end_or_tab(c.code)))
      out += text.substr(0, c.bytes);
    else
      out += is_line_end_or_tab(c.code) ? " " : "\uFFFD";
    text.remove_prefix(c.bytes);
  }
  return out;
}

std::string unprintable_character(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_character(text);
    if (c.code == no_character) return "a byte that is not UTF-8";
    if (!is_printable(c.code) && !is_line_end_or_tab(c.code))
      return fmt::format("U+{:04X}", static_cast<std::uint32_t>(c.code));
    text.remove_prefix(c.bytes);
  }
  return {};
}

}  // namespace wienertree::text
