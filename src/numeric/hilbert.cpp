#include "wienertree/numeric/hilbert.hpp"

#include <cassert>

#include "wienertree/numeric/clones.hpp"

namespace wienertree {

WIENERTREE_CLONES void hilbert_keys(HilbertAxes& x, std::size_t d, unsigned bits,
                                    std::array<std::uint64_t, hilbert_block>& keys) {
  assert(d >= 1 && d <= largest_hilbert_dimension && bits >= 1 && bits <= 32 && d * bits <= 64);
  auto& x0 = x[0];
  for (unsigned bit = bits - 1; bit > 0; --bit) {
    const std::uint32_t below = (std::uint32_t{1} << bit) - 1;
    for (std::size_t l = 0; l < hilbert_block; ++l) x0[l] ^= below & (0 - (x0[l] >> bit & 1));
    for (std::size_t i = 1; i < d; ++i)
      for (std::size_t l = 0; l < hilbert_block; ++l) {
        // Bit set: invert the lower bits of axis 0; else exchange them with those of axis i.
        const std::uint32_t invert = 0 - (x[i][l] >> bit & 1);
        const std::uint32_t exchange = (x0[l] ^ x[i][l]) & below & ~invert;
        x0[l] ^= (below & invert) | exchange;
        x[i][l] ^= exchange;
      }
  }
  for (std::size_t i = 1; i < d; ++i)
    for (std::size_t l = 0; l < hilbert_block; ++l) x[i][l] ^= x[i - 1][l];
  for (std::size_t l = 0; l < hilbert_block; ++l) {
    // t_q = parity of the bits of the last axis above q
    std::uint32_t t = x[d - 1][l] >> 1;
    for (unsigned shift = 1; shift < 32; shift *= 2) t ^= t >> shift;
    for (std::size_t i = 0; i < d; ++i) x[i][l] ^= t;
  }
  keys.fill(0);
  for (unsigned bit = bits; bit-- > 0;)
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t l = 0; l < hilbert_block; ++l) keys[l] = keys[l] << 1 | (x[i][l] >> bit & 1);
}

}  // namespace wienertree
