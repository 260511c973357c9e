#pragma once
/// Whether a picture or a page is well formed.
#include <string>
#include <vector>

namespace cli {

/// What a document holds.
struct Markup {
  std::vector<std::string> elements;  ///< names, in order
  std::string text;                   ///< between the tags, with entities resolved
};

enum class MarkupKind { xml, html };

/// Reads a document strictly: UTF-8 without control characters, tags that close in order (of HTML, all but the void
/// ones), attributes in quotes, no bare '<' and, of XML, no bare '&'.
/// @throws std::runtime_error with the piece of the document where it is not so
Markup parse_markup(const std::string& document, MarkupKind kind);

}  // namespace cli
