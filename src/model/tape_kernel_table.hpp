#pragma once
/// The kernels compiled into this build. Which exist beside the portable one is decided by CMake.
#include "wienertree/model/tape_kernel.hpp"

namespace wienertree {

/// The elementary functions on one number, for those that a machine computes lane by lane.
#define X(operation, ...) double scalar_##operation(double x);
WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X

extern const TapeKernel portable_kernel;
#ifdef WIENERTREE_LIBMVEC
extern const TapeKernel sse2_kernel;
extern const TapeKernel avx2_kernel;    // AVX2 and FMA
extern const TapeKernel avx512_kernel;  // AVX-512F
#endif

}  // namespace wienertree
