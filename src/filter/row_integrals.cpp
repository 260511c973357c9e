// Compiled with -ffp-contract=off: every instruction set returns the same bits.
#include "wienertree/filter/row_integrals.hpp"

#include "wienertree/tree/clones.hpp"

namespace wienertree {
namespace {

constexpr std::size_t lanes = 8;  ///< partial sums, which vector registers hold

template <class Add>
[[gnu::always_inline]] inline void for_gaps(std::size_t gaps, Add add) {
  std::size_t r = 0;
  for (; r + lanes <= gaps; r += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane) add(r + lane, lane);
  for (; r < gaps; ++r) add(r, 0);
}

// On a gap [u, v] of length delta with U = p, q at its ends: delta/2 (p + q), delta/6 (p (2u + v) + q (u +
// 2v)), delta/12 (p (3u^2 + 2uv + v^2) + q (u^2 + 2uv + 3v^2)).
[[gnu::always_inline]] inline RowIntegrals integrals(const double* t, const double* y, std::size_t stride,
                                                     std::size_t gaps) {
  const double start = t[0], last = y[gaps * stride];
  double i0[lanes] = {}, j1[lanes] = {}, j2[lanes] = {};
  for_gaps(
      gaps, [&](std::size_t r, std::size_t lane) __attribute__((always_inline)) {
        const double u = t[r] - start, v = t[r + 1] - start, delta = v - u;
        const double p = delta * (last - y[r * stride]), q = delta * (last - y[(r + 1) * stride]);
        const double uu = u * u, vv = v * v, square = (u + v) * (u + v);
        i0[lane] += p + q;
        j1[lane] += p * (u + u + v) + q * (u + v + v);
        j2[lane] += p * (uu + uu + square) + q * (vv + vv + square);
      });
  RowIntegrals sum;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    sum.i0 += i0[lane] / 2;
    sum.j1 += j1[lane] / 6;
    sum.j2 += j2[lane] / 12;
  }
  return sum;
}

// delta/6 (2 (p_a p_b + q_a q_b) + p_a q_b + q_a p_b) on a gap.
[[gnu::always_inline]] inline double products(const double* t, const double* a, const double* b,
                                              std::size_t stride, std::size_t gaps) {
  const double last_a = a[gaps * stride], last_b = b[gaps * stride];
  double sums[lanes] = {}, sum = 0;
  for_gaps(
      gaps, [&](std::size_t r, std::size_t lane) __attribute__((always_inline)) {
        const double pa = last_a - a[r * stride], qa = last_a - a[(r + 1) * stride];
        const double pb = last_b - b[r * stride], qb = last_b - b[(r + 1) * stride];
        sums[lane] += (t[r + 1] - t[r]) * (2 * (pa * pb + qa * qb) + pa * qb + qa * pb);
      });
  for (const double x : sums) sum += x;
  return sum / 6;
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
  double squares[lanes] = {}, cubes[lanes] = {}, square = 0, cube = 0;
  for_gaps(
      gaps, [&](std::size_t r, std::size_t lane) __attribute__((always_inline)) {
        const double delta = t[r + 1] - t[r];
        squares[lane] += delta * delta;
        cubes[lane] += delta * delta * delta;
      });
  for (const double x : squares) square += x;
  for (const double x : cubes) cube += x;
  return square / 6 - cube / (12 * (t[gaps] - t[0]));
}

}  // namespace wienertree
