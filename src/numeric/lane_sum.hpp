#pragma once
/// Sums in a fixed order that processors with wide registers can follow.
#include <cstddef>
#include <cstring>

namespace wienertree {

inline constexpr std::size_t sum_lanes = 8;

/// In one register, two or four: an array would be kept in memory, and every sum wait for the store before
/// it.
typedef double SumLanes __attribute__((vector_size(sum_lanes * sizeof(double))));

/// As many values as V has lanes: a double, or SumLanes.
[[gnu::always_inline]] inline void load_lanes(const double* from, double& out) { out = *from; }
[[gnu::always_inline]] inline void load_lanes(const double* from, SumLanes& out) {
  std::memcpy(&out, from, sizeof out);
}

[[gnu::always_inline]] inline double sum_of_lanes(const SumLanes& sum) {
  return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

/// sum_i term(i), i = first..last-1, in eight partial sums whatever the instruction set. To be inlined into
/// functions marked WIENERTREE_CLONES.
template <class Term>
[[gnu::always_inline]] inline double lane_sum(std::size_t first, std::size_t last, Term term) {
  SumLanes sum{}, terms;
  std::size_t i = first;
  for (; i + sum_lanes <= last; i += sum_lanes) {
    double here[sum_lanes];
    for (std::size_t l = 0; l < sum_lanes; ++l) here[l] = term(i + l);
    load_lanes(here, terms);
    sum += terms;
  }
  double rest = 0;
  for (; i < last; ++i) rest += term(i);
  return sum_of_lanes(sum) + rest;
}

/// The same sum over i = 0..n-1 of short terms, which are memory's: term(i, out) writes the term to a double,
/// or those of i, i+1, .. to SumLanes.
template <class Term>
[[gnu::always_inline]] inline double lane_sum_of_loads(std::size_t n, Term term) {
  SumLanes sum{}, terms;
  std::size_t i = 0;
  for (; i + sum_lanes <= n; i += sum_lanes) {
    term(i, terms);
    sum += terms;
  }
  double rest = 0;
  for (double one; i < n; ++i) {
    term(i, one);
    rest += one;
  }
  return sum_of_lanes(sum) + rest;
}

/// sum_i a_i b_i
[[gnu::always_inline]] inline double lane_dot(const double* a, const double* b, std::size_t n) {
  return lane_sum_of_loads(
      n, [&]<class V>(std::size_t i, V & term) __attribute__((always_inline)) {
        V factor;
        load_lanes(a + i, term);
        load_lanes(b + i, factor);
        term *= factor;
      });
}

/// sum_i a_i
[[gnu::always_inline]] inline double lane_total(const double* a, std::size_t n) {
  return lane_sum_of_loads(
      n, [&]<class V>(std::size_t i, V & term) __attribute__((always_inline)) { load_lanes(a + i, term); });
}

}  // namespace wienertree
