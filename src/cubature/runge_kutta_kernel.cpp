// Compiled with -ffp-contract=fast: every sum of products below has one way to be contracted, so that all
// instruction sets with a fused multiply-add return the same bits.
#include "wienertree/cubature/runge_kutta_kernel.hpp"

#include <cstring>

namespace wienertree {
namespace {

// One register.
typedef double Two __attribute__((vector_size(16)));
typedef double Four __attribute__((vector_size(32)));
typedef double Eight __attribute__((vector_size(64)));

constexpr std::size_t group =
    16;  // lanes computed together: independent sums hide the latency of the additions

#define WIENERTREE_INLINE [[gnu::always_inline]] static inline

template <class Vector>
struct Kernel {
  static constexpr std::size_t width = sizeof(Vector) / sizeof(double), registers = group / width;
  struct Group {
    Vector part[registers];
  };

  WIENERTREE_INLINE void load(const double* p, Vector& value) { std::memcpy(&value, p, sizeof value); }
  WIENERTREE_INLINE void store(double* p, const Vector& value) { std::memcpy(p, &value, sizeof value); }

  /// sum_t coefficient_t stage_t at lanes at .. at+group-1; 0 without terms.
  WIENERTREE_INLINE void sum(std::span<const StageTerm> terms, std::size_t at, Group& out) {
    for (std::size_t r = 0; r < registers; ++r) out.part[r] = Vector{};
    for (const StageTerm& term : terms) {
      const double* stage = term.stage + at;
      const double coefficient = term.coefficient;
      for (std::size_t r = 0; r < registers; ++r) {
        Vector k;
        load(stage + r * width, k);
        out.part[r] += k * coefficient;
      }
    }
  }

  WIENERTREE_INLINE void combine(LaneShape shape, const double* base, const double* h,
                                 std::span<const StageTerm> terms, double* out) {
    for (std::size_t i = 0; i < shape.components; ++i)
      for (std::size_t lane = 0; lane < shape.lanes; lane += group) {
        const std::size_t at = i * shape.stride + lane;
        Group total;
        sum(terms, at, total);
        for (std::size_t r = 0; r < registers; ++r) {
          Vector x, step;
          load(base + at + r * width, x);
          load(h + lane + r * width, step);
          store(out + at + r * width, x + step * total.part[r]);
        }
      }
  }

  WIENERTREE_INLINE void grow(Vector& largest, const Vector& value) {
    const Vector size = value < 0.0 ? -value : value;
    largest = size > largest ? size : largest;
  }

  WIENERTREE_INLINE void finish(LaneShape shape, const double* before, const double* h,
                                const StepTerms& terms, FlowTolerance tolerance, double* after,
                                double* squared) {
    for (std::size_t lane = 0; lane < shape.lanes; lane += group) {
      Group e{}, g{}, slope{}, poison{};
      for (std::size_t i = 0; i < shape.components; ++i) {
        const std::size_t at = i * shape.stride + lane;
        Group b_i, e_i, g_i;
        sum(terms.b, at, b_i);
        sum(terms.e, at, e_i);
        sum(terms.g, at, g_i);
        for (std::size_t r = 0; r < registers; ++r) {
          Vector x, k, step;
          load(before + at + r * width, x);
          load(terms.first_stage + at + r * width, k);
          load(h + lane + r * width, step);
          const Vector y = x + step * b_i.part[r];
          store(after + at + r * width, y);
          Vector size{};
          grow(size, x);
          grow(size, y);
          const Vector unit = 1.0 / (size * tolerance.relative + tolerance.absolute);
          grow(e.part[r], e_i.part[r] * unit);
          grow(g.part[r], g_i.part[r] * unit);
          grow(slope.part[r], k * unit);
          grow(slope.part[r], b_i.part[r] * unit);
          // 0, or NaN once anything was not finite: comparisons with NaN above keep the other value.
          poison.part[r] += (e_i.part[r] - e_i.part[r]) + (g_i.part[r] - g_i.part[r]) + (y - y);
        }
      }
      for (std::size_t r = 0; r < registers; ++r) {
        const Vector ratio = g.part[r] / (slope.part[r] + 1e-300);  // 0 / 0 must be 0
        Vector guard = g.part[r] * g.part[r] * ratio * (terms.guard_weight * terms.guard_weight);
        if (terms.guard_power == 4) guard *= ratio;
        const Vector estimate = e.part[r] * e.part[r];
        store(squared + lane + r * width, (guard > estimate ? guard : estimate) + poison.part[r]);
      }
    }
  }
};

#define WIENERTREE_KERNEL(name, Vector, attributes)                                             \
  attributes void combine_##name(LaneShape shape, const double* base, const double* h,          \
                                 std::span<const StageTerm> terms, double* out) {               \
    Kernel<Vector>::combine(shape, base, h, terms, out);                                        \
  }                                                                                             \
  attributes void finish_##name(LaneShape shape, const double* before, const double* h,         \
                                const StepTerms& terms, FlowTolerance tolerance, double* after, \
                                double* squared) {                                              \
    Kernel<Vector>::finish(shape, before, h, terms, tolerance, after, squared);                 \
  }                                                                                             \
  constexpr RungeKuttaKernel kernel_##name{combine_##name, finish_##name};

WIENERTREE_KERNEL(portable, Two, )
#if defined(__x86_64__)
WIENERTREE_KERNEL(avx2, Four, [[gnu::target("avx2,fma")]])
WIENERTREE_KERNEL(avx512, Eight, [[gnu::target("avx512f")]])
#endif

}  // namespace

std::span<const RungeKuttaKernel> runge_kutta_kernels() {
#if defined(__x86_64__)
  static constexpr RungeKuttaKernel kernels[] = {kernel_portable, kernel_avx2, kernel_avx512};
  static const std::size_t count = __builtin_cpu_supports("avx512f")                                 ? 3
                                   : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? 2
                                                                                                     : 1;
  return {kernels, count};
#else
  return {&kernel_portable, 1};
#endif
}

}  // namespace wienertree
