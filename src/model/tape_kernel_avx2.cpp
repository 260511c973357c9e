// The tape by AVX2, FMA and libmvec, four nodes a vector. Compiled with the flags of its instruction set: see
// CMakeLists.txt.
#include <immintrin.h>

#include "wienertree/model/tape_kernel_table.hpp"

#define WIENERTREE_VECTOR __m256d
#define WIENERTREE_INTRINSIC(name) _mm256_##name
#define WIENERTREE_LIBMVEC_1(name) _ZGVdN4v_##name
#define WIENERTREE_LIBMVEC_2(name) _ZGVdN4vv_##name
#define WIENERTREE_FUSED(name) vector_##name

namespace wienertree {
namespace {

__m256d fused(__m256d a, __m256d b, __m256d c) { return _mm256_fmadd_pd(a, b, c); }
__m256d nan_of(__m256d a, __m256d result) {
  return _mm256_blendv_pd(result, a, _mm256_cmp_pd(a, a, _CMP_UNORD_Q));
}
__m256d positive(__m256d a) {
  return _mm256_and_pd(_mm256_cmp_pd(a, _mm256_setzero_pd(), _CMP_GT_OQ), _mm256_set1_pd(1.0));
}
__m256d magnitude(__m256d a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
__m256d where_not_zero(__m256d c, __m256d a) {
  return _mm256_and_pd(_mm256_cmp_pd(c, _mm256_setzero_pd(), _CMP_NEQ_UQ), a);
}
__m256d where_zero(__m256d c, __m256d a) {
  return _mm256_and_pd(_mm256_cmp_pd(c, _mm256_setzero_pd(), _CMP_EQ_OQ), a);
}

}  // namespace
}  // namespace wienertree

#include "tape_exponential.inl"
// each needs what stands before it
#include "tape_machine_x86.inl"
//
#include "tape_kernel.inl"

namespace wienertree {
constinit const TapeKernel avx2_kernel{"avx2", Machine::width, run_program};
}
