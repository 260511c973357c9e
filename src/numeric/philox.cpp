#include "wienertree/numeric/philox.hpp"

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

namespace {

void philox_portable(const PhiloxStream& s, std::uint64_t first, PhiloxBlock& out) {
  for (std::size_t c = 0; c < philox_block; ++c) {
    const auto [low, high] = philox(s, first + c);
    out.low[c] = low;
    out.high[c] = high;
  }
}

#if defined(__x86_64__)

// One 32-bit word of a counter lies in the low half of each 64-bit lane. The upper halves may hold anything:
// the multiplication reads the low halves only. A strand is a register of counters; as many strands are run
// at once as hide the latency of the multiplication and fit into the registers.
__attribute__((target("avx2"))) void philox_avx2(const PhiloxStream& s, std::uint64_t first,
                                                 PhiloxBlock& out) {
  const __m256i multiplier_0 = _mm256_set1_epi64x(PHILOX_M4x32_0);
  const __m256i multiplier_1 = _mm256_set1_epi64x(PHILOX_M4x32_1);
  const __m256i low_half = _mm256_set1_epi64x(0xffffffff);
  constexpr std::size_t width = 4, strands = 2;
  for (std::size_t c = 0; c < philox_block; c += width * strands) {
    __m256i c0[strands], c1[strands], c2[strands], c3[strands];
    for (std::size_t g = 0; g < strands; ++g) {
      const std::uint64_t counter = first + c + width * g;
      c0[g] = _mm256_add_epi64(_mm256_set1_epi64x(static_cast<long long>(counter)),
                               _mm256_setr_epi64x(0, 1, 2, 3));
      c1[g] = _mm256_xor_si256(_mm256_srli_epi64(c0[g], 32), _mm256_set1_epi64x(s.tag));
      c2[g] = _mm256_set1_epi64x(s.step);
      c3[g] = _mm256_set1_epi64x(s.launch);
    }
    std::uint32_t key_0 = s.key[0], key_1 = s.key[1];
    for (int round = 0; round < 10; ++round) {
      const __m256i k0 = _mm256_set1_epi64x(key_0), k1 = _mm256_set1_epi64x(key_1);
#pragma GCC unroll 2
      for (std::size_t g = 0; g < strands; ++g) {
        const __m256i p0 = _mm256_mul_epu32(c0[g], multiplier_0), p1 = _mm256_mul_epu32(c2[g], multiplier_1);
        c0[g] = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(p1, 32), c1[g]), k0);
        c1[g] = p1;
        c2[g] = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(p0, 32), c3[g]), k1);
        c3[g] = p0;
      }
      key_0 += PHILOX_W32_0;
      key_1 += PHILOX_W32_1;
    }
    for (std::size_t g = 0; g < strands; ++g) {
      const __m256i low = _mm256_or_si256(_mm256_slli_epi64(c1[g], 32), _mm256_and_si256(c0[g], low_half));
      const __m256i high = _mm256_or_si256(_mm256_slli_epi64(c3[g], 32), _mm256_and_si256(c2[g], low_half));
      _mm256_store_si256(reinterpret_cast<__m256i*>(out.low.data() + c + width * g), low);
      _mm256_store_si256(reinterpret_cast<__m256i*>(out.high.data() + c + width * g), high);
    }
  }
}

__attribute__((target("avx512f"))) void philox_avx512(const PhiloxStream& s, std::uint64_t first,
                                                      PhiloxBlock& out) {
  constexpr int xor_of_three = 0x96;  // _mm512_ternarylogic_epi64's table
  constexpr std::size_t width = 8, strands = philox_block / width;
  const __m512i multiplier_0 = _mm512_set1_epi64(PHILOX_M4x32_0);
  const __m512i multiplier_1 = _mm512_set1_epi64(PHILOX_M4x32_1);
  const __m512i low_half = _mm512_set1_epi64(0xffffffff);
  __m512i c0[strands], c1[strands], c2[strands], c3[strands];
  for (std::size_t g = 0; g < strands; ++g) {
    const std::uint64_t counter = first + width * g;
    c0[g] = _mm512_add_epi64(_mm512_set1_epi64(static_cast<long long>(counter)),
                             _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 6, 7));
    c1[g] = _mm512_xor_si512(_mm512_srli_epi64(c0[g], 32), _mm512_set1_epi64(s.tag));
    c2[g] = _mm512_set1_epi64(s.step);
    c3[g] = _mm512_set1_epi64(s.launch);
  }
  std::uint32_t key_0 = s.key[0], key_1 = s.key[1];
  for (int round = 0; round < 10; ++round) {
    const __m512i k0 = _mm512_set1_epi64(key_0), k1 = _mm512_set1_epi64(key_1);
#pragma GCC unroll 4
    for (std::size_t g = 0; g < strands; ++g) {
      const __m512i p0 = _mm512_mul_epu32(c0[g], multiplier_0), p1 = _mm512_mul_epu32(c2[g], multiplier_1);
      c0[g] = _mm512_ternarylogic_epi64(_mm512_srli_epi64(p1, 32), c1[g], k0, xor_of_three);
      c1[g] = p1;
      c2[g] = _mm512_ternarylogic_epi64(_mm512_srli_epi64(p0, 32), c3[g], k1, xor_of_three);
      c3[g] = p0;
    }
    key_0 += PHILOX_W32_0;
    key_1 += PHILOX_W32_1;
  }
  constexpr int first_and_second_or_third = 0xea;
  for (std::size_t g = 0; g < strands; ++g) {
    const __m512i low =
        _mm512_ternarylogic_epi64(c0[g], low_half, _mm512_slli_epi64(c1[g], 32), first_and_second_or_third);
    const __m512i high =
        _mm512_ternarylogic_epi64(c2[g], low_half, _mm512_slli_epi64(c3[g], 32), first_and_second_or_third);
    _mm512_store_si512(out.low.data() + width * g, low);
    _mm512_store_si512(out.high.data() + width * g, high);
  }
}

#endif

}  // namespace

std::span<const PhiloxKernel> philox_kernels() {
#if defined(__x86_64__)
  static constexpr PhiloxKernel kernels[] = {philox_portable, philox_avx2, philox_avx512};
  static const std::size_t count =
      __builtin_cpu_supports("avx512f") ? 3 : (__builtin_cpu_supports("avx2") ? 2 : 1);
  return {kernels, count};
#else
  static constexpr PhiloxKernel kernels[] = {philox_portable};
  return kernels;
#endif
}

void philox(const PhiloxStream& s, std::uint64_t first, PhiloxBlock& out) {
  static const PhiloxKernel fastest = philox_kernels().back();
  fastest(s, first, out);
}

}  // namespace wienertree
