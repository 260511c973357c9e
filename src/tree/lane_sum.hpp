#pragma once
/// Sums in a fixed order that processors with wide registers can follow.
#include <cstddef>
#include <cstring>

namespace wienertree {

inline constexpr std::size_t sum_lanes = 8;

/// In one register, two or four: an array would be kept in memory, and every sum wait for the store before
/// it.
typedef double SumLanes __attribute__((vector_size(sum_lanes * sizeof(double))));

/// sum_i term(i), i = first..last-1, in eight partial sums whatever the instruction set. To be inlined into
/// functions marked WIENERTREE_CLONES.
template <class Term>
[[gnu::always_inline]] inline double lane_sum(std::size_t first, std::size_t last, Term term) {
  SumLanes sum{}, terms;
  std::size_t i = first;
  for (; i + sum_lanes <= last; i += sum_lanes) {
    double here[sum_lanes];
    for (std::size_t l = 0; l < sum_lanes; ++l) here[l] = term(i + l);
    std::memcpy(&terms, here, sizeof terms);
    sum += terms;
  }
  double rest = 0;
  for (; i < last; ++i) rest += term(i);
  return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7])) + rest;
}

}  // namespace wienertree
