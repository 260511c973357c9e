#pragma once
/// Weights as whole numbers. Every method that counts particles runs on the same exact arithmetic: site i is
/// owed N g_i particles, written as an integer m_i in units of 2^-B of a particle, and the m_i sum to N 2^B
/// exactly. Prefix sums, integer parts and fractional parts are then exact, and a method's law holds without
/// rounding for the weights m_i / (N 2^B).
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "wienertree/numeric/buffer.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

struct ParticleMasses {
  static constexpr std::size_t chunk = 128;
  Buffer<std::uint64_t> mass;             ///< M values, sum = particles << fraction_bits
  std::vector<std::uint64_t> chunk_mass;  ///< sums over `chunk` sites each, the last over what remains
  std::uint64_t particles = 0;            ///< N
  int fraction_bits = 0;                  ///< B = 63 - bits of N, so that 2^62 <= N 2^B < 2^63
  bool all_positive = false;              ///< no log-weight is -infinity
  double log_total = 0;                   ///< log sum_i exp(log_weight_i)
  std::vector<double> scratch;
};

inline constexpr std::uint64_t largest_particle_number = 0xffffffff;

/// Integers m_i for weights g_i = exp(log_weight_i - log_total), for any log-weights, -infinity included:
///
///     |m_i - N g_i 2^B| <= 1/2 + 2^-48 N g_i 2^B
///
/// except at the first site of largest weight, which also takes what is missing from the total (at most
/// M/2 + 2^-48 N 2^B units, of its at least N 2^B / M). Equal weights are exact when M divides N; a site
/// below 2^-64 of the total has m_i = 0. Buffers of `out` are reused.
/// @throws RunError if no weight is positive, or one is NaN or +infinity (naming the first such site)
/// @throws InputError if N is 0 or above largest_particle_number, or there are 2^32 sites or more
/// @param threads to work on, if any; the masses do not depend on it
void assign_masses(std::span<const double> log_weight, std::uint64_t particles, ParticleMasses& out,
                   ThreadPool* threads = nullptr);

/// Splits `mass` over children of weights lambda_j > 0 (sum 1 up to rounding): m_j = [mass lambda_j], and the
/// remainder (at most one unit a child and rounding) to the largest. The m_j sum to `mass` exactly.
/// @pre mass < 2^63, as many children as lambdas
void split_mass(std::uint64_t mass, std::span<const double> lambda, std::span<std::uint64_t> children);

}  // namespace wienertree
