#include "wienertree/model/text/toml_depth.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "wienertree/model/text/location.hpp"

namespace wienertree::text {
namespace {

// Position after the string that opens with the quote at `i`. Of a string that is not closed, after its line, or at
// the end of the text where it may have several lines.
std::size_t after_string(std::string_view text, std::size_t i) {
  const char quote = text[i];
  const bool several_lines = text.substr(i, 3) == std::string(3, quote);
  i += several_lines ? 3 : 1;
  for (; i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"') {
      ++i;
    } else if (!several_lines && (text[i] == quote || text[i] == '\n')) {
      return text[i] == quote ? i + 1 : i;
    } else if (several_lines && text.substr(i, 3) == std::string(3, quote)) {
      i += 3;
      // The content of such a string may end with one or two quotes.
      for (int k = 0; k < 2 && i < text.size() && text[i] == quote; ++k) ++i;
      return i;
    }
  }
  return text.size();
}

}  // namespace

void limit_toml_depth(std::string_view text, const std::string& file) {
  std::size_t parts = 1, depth = 0;
  const auto fail = [&](const std::string& message, std::size_t at) {
    Location place{file, 1, 0, ""};
    for (const char c : text.substr(0, at)) place.line += c == '\n' ? 1 : 0;
    throw InputError(message, place.text());
  };
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      i = after_string(text, i);
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '.') {
      if (++parts > most_key_parts) fail(fmt::format("a key of more than {} parts", most_key_parts), i);
    } else if (c == '[' || c == '{') {
      if (++depth > deepest_toml)
        fail(fmt::format("lists and tables nested deeper than {} levels", deepest_toml), i);
      parts = 1;
    } else if (c == ']' || c == '}') {
      depth -= depth > 0 ? 1 : 0;
      parts = 1;
    } else if (c == '\n' || c == '=' || c == ',') {
      parts = 1;
    }
    ++i;
  }
}

}  // namespace wienertree::text
