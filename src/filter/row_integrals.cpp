// Compiled with -ffp-contract=off: every instruction set returns the same bits.
#include "wienertree/filter/row_integrals.hpp"

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/lane_sum.hpp"

namespace wienertree {
namespace {

#define WIENERTREE_INLINE [[gnu::always_inline]] inline

// Values r, r+1, .. of a column: one, or as many as there are lanes.
WIENERTREE_INLINE void load(const double* x, std::size_t stride, std::size_t r, double& out) {
  out = x[r * stride];
}
WIENERTREE_INLINE void load(const double* x, std::size_t stride, std::size_t r, SumLanes& out) {
  if (stride == 1)
    load_lanes(x + r, out);
  else
    for (std::size_t lane = 0; lane < sum_lanes; ++lane) out[lane] = x[(r + lane) * stride];
}

// total[k] becomes the sum over the gaps r = 0..gaps-1 of what add(r, sums) adds to sums[k], k = 0..K-1; sums
// are doubles or have lanes.
template <std::size_t K, class Add>
WIENERTREE_INLINE void sum_gaps(std::size_t gaps, Add add, double (&total)[K]) {
  SumLanes in_lanes[K] = {};
  std::size_t r = 0;
  for (; r + sum_lanes <= gaps; r += sum_lanes) add(r, in_lanes);
  for (double& sum : total) sum = 0;
  for (; r < gaps; ++r) add(r, total);
  for (std::size_t k = 0; k < K; ++k)
    for (std::size_t lane = 0; lane < sum_lanes; ++lane) total[k] += in_lanes[k][lane];
}

// On a gap [u, v] of length delta with U = p, q at its ends: delta/2 (p + q),
// delta/6 (p (2u + v) + q (u + 2v)), delta/12 (p (3u^2 + 2uv + v^2) + q (u^2 + 2uv + 3v^2)).
WIENERTREE_INLINE RowIntegrals integrals(const double* t, const double* y, std::size_t stride,
                                         std::size_t gaps) {
  const double start = t[0], last = y[gaps * stride];
  double total[3];
  sum_gaps(
      gaps,
      [&]<class V>(std::size_t r, V(&sums)[3]) __attribute__((always_inline)) {
        V u, v, y_u, y_v;
        load(t, 1, r, u);
        load(t, 1, r + 1, v);
        load(y, stride, r, y_u);
        load(y, stride, r + 1, y_v);
        u -= start;
        v -= start;
        const V p = (v - u) * (last - y_u), q = (v - u) * (last - y_v);
        const V uu = u * u, vv = v * v, square = (u + v) * (u + v);
        sums[0] += p + q;
        sums[1] += p * (u + u + v) + q * (u + v + v);
        sums[2] += p * (uu + uu + square) + q * (vv + vv + square);
      },
      total);
  return {total[0] / 2, total[1] / 6, total[2] / 12};
}

// delta/6 (2 (p_a p_b + q_a q_b) + p_a q_b + q_a p_b) on a gap.
WIENERTREE_INLINE double products(const double* t, const double* a, const double* b, std::size_t stride,
                                  std::size_t gaps) {
  const double last_a = a[gaps * stride], last_b = b[gaps * stride];
  double total[1];
  sum_gaps(
      gaps,
      [&]<class V>(std::size_t r, V(&sums)[1]) __attribute__((always_inline)) {
        V u, v, p_a, q_a, p_b, q_b;
        load(t, 1, r, u);
        load(t, 1, r + 1, v);
        load(a, stride, r, p_a);
        load(a, stride, r + 1, q_a);
        load(b, stride, r, p_b);
        load(b, stride, r + 1, q_b);
        p_a = last_a - p_a;
        q_a = last_a - q_a;
        p_b = last_b - p_b;
        q_b = last_b - q_b;
        sums[0] += (v - u) * (2.0 * (p_a * p_b + q_a * q_b) + p_a * q_b + q_a * p_b);
      },
      total);
  return total[0] / 6;
}

}  // namespace

// With a stride known to be 1 the loads are contiguous.
WIENERTREE_CLONES RowIntegrals row_integrals(const double* t, const double* y, std::size_t stride,
                                             std::size_t gaps) {
  return stride == 1 ? integrals(t, y, 1, gaps) : integrals(t, y, stride, gaps);
}

WIENERTREE_CLONES double row_products(const double* t, const double* a, const double* b, std::size_t stride,
                                      std::size_t gaps) {
  return stride == 1 ? products(t, a, b, 1, gaps) : products(t, a, b, stride, gaps);
}

WIENERTREE_CLONES double row_bridge_variance(const double* t, std::size_t gaps) {
  double total[1];
  sum_gaps(
      gaps,
      [&]<class V>(std::size_t r, V(&sums)[1]) __attribute__((always_inline)) {
        V u, v;
        load(t, 1, r, u);
        load(t, 1, r + 1, v);
        const V delta = v - u;
        sums[0] += delta * delta;
      },
      total);
  return total[0] / 6;
}

}  // namespace wienertree
