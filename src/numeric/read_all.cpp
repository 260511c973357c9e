#include "wienertree/numeric/read_all.hpp"

#include <fmt/format.h>

#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree {

std::string read_all(std::istream& in, std::size_t most, const std::string& where) {
  std::string text;
  std::vector<char> chunk(1U << 16U);
  while (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || in.gcount() > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > most)
      throw InputError(fmt::format("is too large: it has more than {} bytes", most), where);
  }
  return text;
}

}  // namespace wienertree
