#pragma once
/// What tells whether bytes are those of before.
#include <cstdint>
#include <string>
#include <string_view>

namespace wienertree {

/// CRC-64 of ECMA-182, reflected, as in the xz format.
std::uint64_t checksum(std::string_view bytes);
/// The same as 16 hexadecimal digits.
std::string checksum_text(std::string_view bytes);

}  // namespace wienertree
