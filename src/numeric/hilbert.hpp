#pragma once
/// Hilbert curve in any dimension, by integer arithmetic.
///
/// Skilling (2004), "Programming the Hilbert curve", AIP Conf. Proc. 707, 381-387: Gray-code undoing and the
/// reflections and exchanges of axes are done in place on the d coordinates ("axes to transpose"); the key
/// takes bit b-1 of axes 0, 1, .., d-1, then bit b-2, and so on. Consecutive keys are neighbouring cells.
#include <array>
#include <cstddef>
#include <cstdint>

namespace wienertree {

inline constexpr std::size_t hilbert_block = 32;
inline constexpr std::size_t largest_hilbert_dimension = 64;

/// Coordinates of a block of cells, axis by axis.
using HilbertAxes = std::array<std::array<std::uint32_t, hilbert_block>, largest_hilbert_dimension>;

/// Keys of a block of cells of the grid {0..2^bits - 1}^d. The axes are overwritten.
/// @pre 1 <= d <= 64, 1 <= bits <= 32, d * bits <= 64
void hilbert_keys(HilbertAxes& axes, std::size_t d, unsigned bits,
                  std::array<std::uint64_t, hilbert_block>& keys);

}  // namespace wienertree
