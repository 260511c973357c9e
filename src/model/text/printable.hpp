#pragma once
/// Text of other people, made fit for a terminal, a picture or a page.
#include <string>
#include <string_view>

namespace wienertree::text {

/// What may stand in a text beside letters.
enum class LineEnds { replaced, kept };

/// Replaces by U+FFFD, one for each: control characters (below U+0020, U+007F .. U+009F), which a terminal obeys
/// and XML forbids; marks that turn the direction of the text around them (U+202A .. U+202E, U+2066 .. U+2069);
/// U+FFFE and U+FFFF; and bytes that are not UTF-8. Line ends and tabs become spaces, or are kept.
std::string printable(std::string_view text, LineEnds line_ends = LineEnds::replaced);

/// Name of the first character that `printable` with LineEnds::kept would replace, as "U+0007" or
/// "a byte that is not UTF-8"; empty if there is none.
std::string unprintable_character(std::string_view text);

}  // namespace wienertree::text
