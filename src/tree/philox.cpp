#include "wienertree/tree/philox.hpp"

#include <Random123/philox.h>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace wienertree {

std::array<std::uint64_t, 2> philox(const PhiloxStream& s, std::uint64_t counter) {
  using Generator = r123::Philox4x32;
  const Generator::ctr_type words = {{static_cast<std::uint32_t>(counter),
                                      static_cast<std::uint32_t>(counter >> 32) ^ s.tag, s.step, s.launch}};
  const Generator::ctr_type r = Generator()(words, {{s.key[0], s.key[1]}});
  return {std::uint64_t{r[1]} << 32 | r[0], std::uint64_t{r[3]} << 32 | r[2]};
}

void philox_portable(const PhiloxStream& s, std::uint64_t first, PhiloxBlock& out) {
  for (std::size_t c = 0; c < philox_block; ++c) {
    const auto [low, high] = philox(s, first + c);
    out.low[c] = low;
    out.high[c] = high;
  }
}

#if defined(__x86_64__)
namespace {

// One 32-bit word of a counter lies in the low half of each 64-bit lane. The upper halves may hold anything:
// the multiplication reads the low halves only.
__attribute__((target("avx2"))) void philox_avx2(const PhiloxStream& s, std::uint64_t first,
                                                 PhiloxBlock& out) {
  const __m256i multiplier_0 = _mm256_set1_epi64x(PHILOX_M4x32_0);
  const __m256i multiplier_1 = _mm256_set1_epi64x(PHILOX_M4x32_1);
  const __m256i low_half = _mm256_set1_epi64x(0xffffffff);
  const __m256i tag = _mm256_set1_epi64x(s.tag);
  constexpr std::size_t groups = philox_block / 4;
  __m256i c0[groups], c1[groups], c2[groups], c3[groups];
  for (std::size_t g = 0; g < groups; ++g) {
    c0[g] = _mm256_add_epi64(_mm256_set1_epi64x(static_cast<long long>(first + 4 * g)),
                             _mm256_setr_epi64x(0, 1, 2, 3));
    c1[g] = _mm256_xor_si256(_mm256_srli_epi64(c0[g], 32), tag);
    c2[g] = _mm256_set1_epi64x(s.step);
    c3[g] = _mm256_set1_epi64x(s.launch);
  }
  std::uint32_t key_0 = s.key[0], key_1 = s.key[1];
  for (int round = 0; round < 10; ++round) {
    const __m256i k0 = _mm256_set1_epi64x(key_0), k1 = _mm256_set1_epi64x(key_1);
#pragma GCC unroll 4
    for (std::size_t g = 0; g < groups; ++g) {
      const __m256i p0 = _mm256_mul_epu32(c0[g], multiplier_0), p1 = _mm256_mul_epu32(c2[g], multiplier_1);
      c0[g] = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(p1, 32), c1[g]), k0);
      c1[g] = p1;
      c2[g] = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(p0, 32), c3[g]), k1);
      c3[g] = p0;
    }
    key_0 += PHILOX_W32_0;
    key_1 += PHILOX_W32_1;
  }
  for (std::size_t g = 0; g < groups; ++g) {
    const __m256i low = _mm256_or_si256(_mm256_slli_epi64(c1[g], 32), _mm256_and_si256(c0[g], low_half));
    const __m256i high = _mm256_or_si256(_mm256_slli_epi64(c3[g], 32), _mm256_and_si256(c2[g], low_half));
    _mm256_store_si256(reinterpret_cast<__m256i*>(out.low.data() + 4 * g), low);
    _mm256_store_si256(reinterpret_cast<__m256i*>(out.high.data() + 4 * g), high);
  }
}

}  // namespace

void philox(const PhiloxStream& s, std::uint64_t first, PhiloxBlock& out) {
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2)
    philox_avx2(s, first, out);
  else
    philox_portable(s, first, out);
}
#else
void philox(const PhiloxStream& s, std::uint64_t first, PhiloxBlock& out) { philox_portable(s, first, out); }
#endif

}  // namespace wienertree
