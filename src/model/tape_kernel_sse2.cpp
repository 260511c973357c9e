// The tape by SSE2 and libmvec, two nodes a vector. Compiled with the flags of its instruction set: see
// CMakeLists.txt.
#include <immintrin.h>

#include "wienertree/model/tape_kernel_table.hpp"

#define WIENERTREE_VECTOR __m128d
#define WIENERTREE_INTRINSIC(name) _mm_##name
#define WIENERTREE_LIBMVEC_1(name) _ZGVbN2v_##name
#define WIENERTREE_LIBMVEC_2(name) _ZGVbN2vv_##name
#define WIENERTREE_FUSED(name) WIENERTREE_LIBMVEC_1(name)

namespace wienertree {
namespace {

__m128d fused(__m128d a, __m128d b, __m128d c) { return a * b + c; }
__m128d nan_of(__m128d a, __m128d result) {
  const __m128d is_nan = _mm_cmpunord_pd(a, a);
  return _mm_or_pd(_mm_and_pd(is_nan, a), _mm_andnot_pd(is_nan, result));
}
__m128d positive(__m128d a) { return _mm_and_pd(_mm_cmpgt_pd(a, _mm_setzero_pd()), _mm_set1_pd(1.0)); }
__m128d magnitude(__m128d a) { return _mm_andnot_pd(_mm_set1_pd(-0.0), a); }
__m128d where_not_zero(__m128d c, __m128d a) { return _mm_and_pd(_mm_cmpneq_pd(c, _mm_setzero_pd()), a); }
__m128d where_zero(__m128d c, __m128d a) { return _mm_and_pd(_mm_cmpeq_pd(c, _mm_setzero_pd()), a); }

}  // namespace
}  // namespace wienertree

#include "tape_machine_x86.inl"
// The machine comes first.
#include "tape_kernel.inl"

namespace wienertree {
constinit const TapeKernel sse2_kernel{"sse2", Machine::width, run_program};
}
