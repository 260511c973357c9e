// The tape by AVX-512F and libmvec, eight nodes a vector. Compiled with the flags of its instruction set: see
// CMakeLists.txt.
#include <immintrin.h>

#include "wienertree/model/tape_kernel_table.hpp"

#define WIENERTREE_VECTOR __m512d
#define WIENERTREE_INTRINSIC(name) _mm512_##name
#define WIENERTREE_LIBMVEC_1(name) _ZGVeN8v_##name
#define WIENERTREE_LIBMVEC_2(name) _ZGVeN8vv_##name
#define WIENERTREE_FUSED(name) vector_##name

namespace wienertree {
namespace {

__m512d fused(__m512d a, __m512d b, __m512d c) { return _mm512_fmadd_pd(a, b, c); }
__m512d nan_of(__m512d a, __m512d result) {
  return _mm512_mask_mov_pd(result, _mm512_cmp_pd_mask(a, a, _CMP_UNORD_Q), a);
}
__m512d positive(__m512d a) {
  return _mm512_maskz_mov_pd(_mm512_cmp_pd_mask(a, _mm512_setzero_pd(), _CMP_GT_OQ), _mm512_set1_pd(1.0));
}
__m512d magnitude(__m512d a) { return _mm512_abs_pd(a); }
__m512d where_not_zero(__m512d c, __m512d a) {
  return _mm512_maskz_mov_pd(_mm512_cmp_pd_mask(c, _mm512_setzero_pd(), _CMP_NEQ_UQ), a);
}
__m512d where_zero(__m512d c, __m512d a) {
  return _mm512_maskz_mov_pd(_mm512_cmp_pd_mask(c, _mm512_setzero_pd(), _CMP_EQ_OQ), a);
}

}  // namespace
}  // namespace wienertree

#include "tape_exponential.inl"
// each needs what stands before it
#include "tape_machine_x86.inl"
//
#include "tape_kernel.inl"

namespace wienertree {
constinit const TapeKernel avx512_kernel{"avx512", Machine::width, run_program};
}
