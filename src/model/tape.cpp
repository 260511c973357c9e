#include "wienertree/model/tape.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "wienertree/model/scalar_functions.hpp"
#include "wienertree/model/tape_kernel_table.hpp"

namespace wienertree {

#define X(operation, name, ...) \
  double scalar_##operation(double x) { return scalar::name(x); }
WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X

double apply(Op op, double a, double b) {
  switch (op) {
    case Op::add:
      return a + b;
    case Op::subtract:
      return a - b;
    case Op::multiply:
      return a * b;
    case Op::divide:
      return a / b;
    case Op::power:
      return std::pow(a, b);
    case Op::minimum:
      return scalar::min(a, b);
    case Op::maximum:
      return scalar::max(a, b);
    case Op::where:
      return scalar::where(a, b);
    case Op::unless:
      return scalar::unless(a, b);
    case Op::negate:
      return -a;
    case Op::absolute:
      return std::abs(a);
    case Op::sign:
      return scalar::sign(a);
    case Op::step:
      return scalar::step(a);
#define X(operation, name, ...) \
  case Op::operation:           \
    return scalar::name(a);
      WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
  }
  assert(false);
  return 0.0;
}

bool Tape::jumps() const {
  return std::any_of(program_.begin(), program_.end(), [](const TapeInstruction& i) {
    switch (i.code) {
      case TapeCode::sign_v:
      case TapeCode::step_v:
      case TapeCode::where_vv:
      case TapeCode::where_vs:
      case TapeCode::unless_vv:
      case TapeCode::unless_vs:
        return true;
      default:
        return false;
    }
  });
}

TapeKernels tape_kernels() {
  struct Table {
    std::array<TapeKernel, 4> kernels{};
    std::size_t count = 0;
    Table() {
      kernels[count++] = portable_kernel;
#ifdef WIENERTREE_LIBMVEC
      kernels[count++] = sse2_kernel;
      __builtin_cpu_init();
      if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) kernels[count++] = avx2_kernel;
      if (__builtin_cpu_supports("avx512f")) kernels[count++] = avx512_kernel;
#endif
    }
  };
  static const Table table;
  return {table.kernels.data(), table.count};
}

namespace {

/// Memory of a thread, grown to what its largest tape needs.
struct Scratch {
  std::vector<double> scalars, blocks;
  std::vector<double*> slots;
};

template <class T>
T* at_least(std::vector<T>& memory, std::size_t size) {
  if (memory.size() < size) memory.resize(size);
  return memory.data();
}

}  // namespace

void Tape::evaluate(std::span<const double* const> inputs, std::span<const double> uniforms,
                    std::span<double* const> outputs, std::size_t nodes) const {
  const TapeKernels kernels = tape_kernels();
  evaluate(kernels.kernels[kernels.count - 1], inputs, uniforms, outputs, nodes);
}

void Tape::evaluate(const TapeKernel& kernel, std::span<const double* const> inputs,
                    std::span<const double> uniforms, std::span<double* const> outputs,
                    std::size_t nodes) const {
  assert(inputs.size() == inputs_ && uniforms.size() == uniforms_ && outputs.size() == outputs_);
  if (outputs_ == 0 || nodes == 0) return;
  thread_local Scratch scratch;

  double* const scalars = at_least(scratch.scalars, scalars_);
  std::copy(constants_.begin(), constants_.end(), std::copy(uniforms.begin(), uniforms.end(), scalars));
  for (const UniformInstruction& i : uniform_program_)
    scalars[i.target] = apply(i.op, scalars[i.a], scalars[i.b]);

  const std::size_t ends = inputs_ + outputs_;
  double** const slots = at_least(scratch.slots, ends + registers_);
  double* const blocks = at_least(scratch.blocks, (registers_ + ends) * tape_block);
  for (std::size_t r = 0; r < registers_; ++r) slots[ends + r] = blocks + r * tape_block;
  const auto run = [&](std::size_t lanes) {
    kernel.run(program_.data(), program_.size(), slots, scalars, lanes);
  };

  const std::size_t whole = nodes % kernel.width == 0 ? nodes : nodes - nodes % tape_block;
  if (whole != 0) {
    // A program never writes to an input slot.
    for (std::size_t i = 0; i < inputs_; ++i) slots[i] = const_cast<double*>(inputs[i]);
    for (std::size_t o = 0; o < outputs_; ++o) slots[inputs_ + o] = outputs[o];
    for (std::size_t first = 0; first < whole; first += tape_block) {
      run(std::min(tape_block, whole - first));
      for (std::size_t s = 0; s < ends; ++s) slots[s] += tape_block;
    }
  }
  // The rest is copied and its last node repeated to a whole number of vectors, so that every value comes
  // from the same vector instructions.
  if (const std::size_t rest = nodes - whole; rest != 0) {
    const std::size_t lanes = (rest + kernel.width - 1) / kernel.width * kernel.width;
    for (std::size_t s = 0; s < ends; ++s) slots[s] = blocks + (registers_ + s) * tape_block;
    for (std::size_t i = 0; i < inputs_; ++i) {
      const double* const values = inputs[i] + whole;
      std::fill(std::copy(values, values + rest, slots[i]), slots[i] + lanes, values[rest - 1]);
    }
    run(lanes);
    for (std::size_t o = 0; o < outputs_; ++o) {
      const double* const values = slots[inputs_ + o];
      std::copy(values, values + rest, outputs[o] + whole);
    }
  }
}

}  // namespace wienertree
