#pragma once
/// A limit on how deeply a TOML text is nested, checked before the TOML library reads it: the library builds, visits
/// and destroys nested tables by recursion, and 40 000 of them overflow the stack.
#include <cstddef>
#include <string>
#include <string_view>

namespace wienertree::text {

/// Parts of a key or header, a.b.c being three; and lists and inline tables inside each other. A key of every level may
/// have as many parts, so that tables are at most 32 + 32 * 32 deep.
inline constexpr std::size_t most_key_parts = 32, deepest_toml = 32;

/// A scan of brackets, dots and strings, which needs no stack.
/// @throws InputError naming file and line where a limit is passed
void limit_toml_depth(std::string_view text, const std::string& file);

}  // namespace wienertree::text
