#include "wienertree/numeric/random.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/elementary.hpp"
#include "wienertree/numeric/philox.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 2 * philox_block;  ///< draws a block: two a counter

PhiloxStream philox_stream(const RandomStream& s) {
  return {{static_cast<std::uint32_t>(s.seed), static_cast<std::uint32_t>(s.seed >> 32)},
          static_cast<std::uint32_t>(s.purpose) << 16,
          s.step,
          s.launch};
}

// (k + 1/2) 2^-52 with k the upper 52 bits: the difference is exact.
inline double to_unit(std::uint64_t bits) {
  return std::bit_cast<double>(bits >> 12 | 0x3ff0000000000000) - (1.0 - 0x1.0p-53);
}

WIENERTREE_CLONES void uniform_block(const PhiloxBlock& r, double* out) {
  for (std::size_t c = 0; c < philox_block; ++c) {
    out[2 * c] = to_unit(r.low[c]);
    out[2 * c + 1] = to_unit(r.high[c]);
  }
}

WIENERTREE_CLONES void normal_block(const PhiloxBlock& r, double* out) {
  for (std::size_t c = 0; c < philox_block; ++c) {
    const double radius = std::sqrt(-2.0 * elementary::log_near_unit(to_unit(r.low[c])));
    const auto [sine, cosine] = elementary::sine_cosine_of_turn(to_unit(r.high[c]));
    out[2 * c] = radius * cosine;
    out[2 * c + 1] = radius * sine;
  }
}

WIENERTREE_CLONES void exponential_block(const PhiloxBlock& r, double* out) {
  for (std::size_t c = 0; c < philox_block; ++c) {
    out[2 * c] = -elementary::log_near_unit(to_unit(r.low[c]));
    out[2 * c + 1] = -elementary::log_near_unit(to_unit(r.high[c]));
  }
}

// Whole blocks go straight to `out`; the ragged ends pass through a buffer.
template <class BlockOf>
void fill(const RandomStream& stream, std::uint64_t first, std::span<double> out, BlockOf block_of) {
  const PhiloxStream key = philox_stream(stream);
  PhiloxBlock bits;
  std::array<double, block> buffer;
  for (std::size_t done = 0; done < out.size();) {
    const std::uint64_t index = first + done;
    const std::size_t skip = index % 2;
    philox(key, index / 2, bits);
    if (skip == 0 && out.size() - done >= block) {
      block_of(bits, out.data() + done);
      done += block;
    } else {
      const std::size_t take = std::min(block - skip, out.size() - done);
      block_of(bits, buffer.data());
      std::copy_n(buffer.data() + skip, take, out.data() + done);
      done += take;
    }
  }
}

}  // namespace

double RandomStream::uniform(std::uint64_t index) const {
  return to_unit(philox(philox_stream(*this), index / 2)[index % 2]);
}

void RandomStream::uniforms(std::uint64_t first, std::span<double> out) const {
  fill(*this, first, out, uniform_block);
}

void RandomStream::normals(std::uint64_t first, std::span<double> out) const {
  fill(*this, first, out, normal_block);
}

void RandomStream::exponentials(std::uint64_t first, std::span<double> out) const {
  fill(*this, first, out, exponential_block);
}

}  // namespace wienertree
