#pragma once
/// The machine codes that run a tape's instructions over one block of nodes.
///
/// This header is included by files compiled for instruction sets that the processor at hand may lack. It
/// must not bring in any inline function: the linker keeps one copy of such a function, and it may keep the
/// wrong one.
#include <stddef.h>
#include <stdint.h>

#include "wienertree/model/elementary_functions.hpp"

namespace wienertree {

/// Nodes in a block.
inline constexpr size_t tape_block = 128;

/// Instructions of the tape. A suffix names the operands: v a slot with a value per node, s a scalar.
// clang-format off
#define WIENERTREE_TAPE_BINARY(X) \
  X(add) X(subtract) X(multiply) X(divide) X(power) X(minimum) X(maximum) X(where) X(unless)
#define WIENERTREE_TAPE_FUSED(X) X(multiply_add) X(multiply_subtract) X(negative_multiply_add)
/// What each Machine writes itself; the elementary functions follow.
#define WIENERTREE_TAPE_UNARY(X) X(negate) X(absolute) X(sign) X(step)

enum class TapeCode : uint8_t {
  copy_v,
  copy_s,
#define X(name) name##_vv, name##_vs, name##_sv,
  WIENERTREE_TAPE_BINARY(X)
#undef X
#define X(name) name##_vvv, name##_vvs, name##_vsv, name##_vss,
  WIENERTREE_TAPE_FUSED(X)  // a b + c,  a b - c,  c - a b
#undef X
#define X(name, ...) name##_v,
  WIENERTREE_TAPE_UNARY(X)
  WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
};
// clang-format on

/// slot[target] = code(a, b, c); an operand is the index of a slot or of a scalar, as the code's suffix says.
struct TapeInstruction {
  TapeCode code;
  uint32_t target, a, b, c;
};

/// Runs a program over `lanes` nodes, a positive multiple of the kernel's width.   slots: arrays of `lanes`
/// values.
using TapeRun = void (*)(const TapeInstruction* program, size_t instructions, double* const* slots,
                         const double* scalars, size_t lanes);

struct TapeKernel {
  const char* name;  ///< "portable", "sse2", "avx2", "avx512"
  size_t width;      ///< nodes in a vector; divides tape_block
  TapeRun run;
};

/// The kernels that this build has and this processor runs, slowest first, at most 4.
struct TapeKernels {
  const TapeKernel* kernels;
  size_t count;
};
TapeKernels tape_kernels();

}  // namespace wienertree
