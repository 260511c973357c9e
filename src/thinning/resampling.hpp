#pragma once
/// The classical ways to count particles, on the integer masses of masses.hpp. With C_i the prefix sums of
/// the masses in particles (C_M = N), all return counts o_i with sum o_i = N and E o_i = N g_i:
///
/// - systematic: o_i = [C_i + U] - [C_{i-1} + U], one U (Kitagawa 1996, J. Comput. Graph. Statist. 5, 1-25,
///   appendix; Carpenter, Clifford, Fearnhead 1999, IEE Proc. Radar Sonar Navig. 146, 2-7);
/// - stratified: o_i = number of k = 0..N-1 with C_{i-1} <= k + U_k < C_i (Kitagawa 1996);
/// - multinomial: o_i = number of k with C_{i-1} <= N U_k < C_i (Gordon, Salmond, Smith 1993,
///   IEE Proc. F 140, 107-113), the U_k drawn in ascending order by exponential spacings
///   (Devroye 1986, Non-Uniform Random Variate Generation, section V.3.1);
///
/// - residual: o_i = [N g_i] + multinomial counts of what remains on the fractions {N g_i} (Liu, Chen 1998,
///   J. Amer. Statist. Assoc. 93, 1032-1044).
///
/// Compared by Douc, Cappe, Moulines (2005), "Comparison of resampling schemes for particle filtering",
/// ISPA 2005, 64-69. Time O(M) for systematic, O(M + N) for the others.
///
/// @pre of all: sum mass = N 2^fraction_bits, count.size() == mass.size()
#include <cstdint>
#include <span>

#include "wienertree/numeric/random.hpp"

namespace wienertree {

void systematic_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                       std::span<std::uint32_t> count);
void stratified_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                       std::span<std::uint32_t> count);
void multinomial_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                        std::span<std::uint32_t> count);
void residual_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                     std::span<std::uint32_t> count);

}  // namespace wienertree
