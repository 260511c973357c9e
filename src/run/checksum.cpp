#include "wienertree/run/checksum.hpp"

#include <fmt/format.h>

#include <boost/crc.hpp>

namespace wienertree {

std::uint64_t checksum(std::string_view bytes) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693, 0xFFFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

std::string checksum_text(std::string_view bytes) { return fmt::format("{:016x}", checksum(bytes)); }

}  // namespace wienertree
