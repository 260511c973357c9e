#pragma once
/// Files that are read whole, up to a size.
#include <cstddef>
#include <istream>
#include <string>

namespace wienertree {

/// Of files that people write by hand: models, studies, formulas.
inline constexpr std::size_t largest_text_file = std::size_t{16} << 20;

/// The rest of `in`.
/// @throws InputError at `where` if that is more than `most` bytes, as of a device that never ends. Whether reading
/// failed is left in the state of `in`.
std::string read_all(std::istream& in, std::size_t most, const std::string& where);

}  // namespace wienertree
