#pragma once
/// Blocks of Philox4x32-10 (Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3",
/// SC11), the bijection of Random123's `philox.h`, four or eight counters to a vector register where the
/// processor has AVX2 or AVX-512.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace wienertree {

inline constexpr std::size_t philox_block = 32;

/// What a stream fixes: the key and three of the counter's words. Counter number c is
/// (low word of c, high word of c XOR tag, step, launch).
struct PhiloxStream {
  std::array<std::uint32_t, 2> key{};
  std::uint32_t tag = 0, step = 0, launch = 0;
};

/// The outputs of counters first .. first + philox_block - 1, two 64-bit words a counter: word (r_1, r_0) in
/// `low[c]` and (r_3, r_2) in `high[c]`, where (a, b) = 2^32 a + b.
struct PhiloxBlock {
  alignas(64) std::array<std::uint64_t, philox_block> low, high;
};

using PhiloxKernel = void (*)(const PhiloxStream& stream, std::uint64_t first, PhiloxBlock& out);

/// By the fastest kernel.
void philox(const PhiloxStream& stream, std::uint64_t first, PhiloxBlock& out);

/// What this processor runs, slowest first: Random123's scalar code, AVX2, AVX-512. They give the same bits.
std::span<const PhiloxKernel> philox_kernels();

/// One counter: (low, high).
std::array<std::uint64_t, 2> philox(const PhiloxStream& stream, std::uint64_t counter);

}  // namespace wienertree
