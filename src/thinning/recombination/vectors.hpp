#pragma once
/// Vectors in a fixed order of operations that processors with wide registers can follow: eight partial sums,
/// whatever the instruction set. To be inlined into functions marked WIENERTREE_CLONES.
#include <cstddef>
#include <vector>

#include "wienertree/numeric/lane_sum.hpp"

namespace wienertree::recombination {

inline constexpr std::size_t lanes = sum_lanes;

/// Lengths of vectors that `dot` and `add_multiple` take; what lies beyond n is to be 0.
inline constexpr std::size_t padded(std::size_t n) { return (n + lanes - 1) / lanes * lanes; }

inline void grow(std::vector<double>& v, std::size_t n) {
  if (v.size() < n) v.resize(n);
}

/// Four doubles of an array of doubles.
using Four [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;

[[gnu::always_inline]] inline Four& four(double* a) { return *reinterpret_cast<Four*>(a); }
[[gnu::always_inline]] inline const Four& four(const double* a) { return *reinterpret_cast<const Four*>(a); }
[[gnu::always_inline]] inline double sum(const Four& a) { return (a[0] + a[2]) + (a[1] + a[3]); }

/// a . b, both of padded length n.
[[gnu::always_inline]] inline double dot(const double* a, const double* b, std::size_t n) {
  Four even{}, odd{};
  for (std::size_t i = 0; i < n; i += lanes) {
    even += four(a + i) * four(b + i);
    odd += four(a + i + 4) * four(b + i + 4);
  }
  return sum(even + odd);
}

/// a += factor b, both of padded length n.
[[gnu::always_inline]] inline void add_multiple(double* a, double factor, const double* b, std::size_t n) {
  for (std::size_t i = 0; i < n; i += 4) four(a + i) += factor * four(b + i);
}

/// Mean and standard deviation under weights w_i >= 0 of positive sum; two passes.
struct MeanDeviation {
  double mean, deviation;
};
MeanDeviation mean_deviation(const double* x, const double* w, std::size_t n);

}  // namespace wienertree::recombination
