#pragma once
/// Expressions compiled to a register tape, evaluated over blocks of nodes with vectorised elementary
/// functions.
///
/// A tape is a straight-line program. Each instruction runs over a block of `tape_block` nodes before the
/// next one starts, so that its dispatch costs little, the registers (one block of doubles each) stay in the
/// first-level cache, and the elementary functions are called a vector at a time. Where the processor and the
/// C library allow it, the functions are those of glibc's libmvec (at most 4 units in the last place from the
/// exact value).
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "wienertree/model/tape_kernel.hpp"

namespace wienertree {

/// Operations of an expression. A NaN operand gives NaN (also in minimum, maximum, sign and step), except
/// that power(NaN, 0) = 1 and that `where` and `unless` ignore the operand that they do not choose; a value
/// out of the domain gives NaN.
enum class Op : std::uint8_t {
// In this order: add, subtract, multiply, divide, power, minimum, maximum,
// where: b where the condition a holds (is not 0), else 0, whatever b is there;
// unless: b where it does not hold, else 0;
// negate, absolute, sign: -1, 0, 1; step: 1 for x > 0, else 0; the elementary functions.
#define X(name, ...) name,
  WIENERTREE_TAPE_BINARY(X) WIENERTREE_TAPE_UNARY(X) WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
};

constexpr bool is_binary(Op op) { return op <= Op::unless; }
/// Whether the value jumps or has a kink as a function of an argument.
constexpr bool is_piecewise(Op op) {
  return op == Op::minimum || op == Op::maximum || op == Op::where || op == Op::unless ||
         op == Op::absolute || op == Op::sign || op == Op::step;
}

/// The operation on numbers, by the C library's scalar functions. `b` is ignored by unary operations.
double apply(Op op, double a, double b = 0.0);

/// A compiled list of expressions. Immutable and thread-safe; the empty tape has no outputs.
class Tape {
 public:
  std::size_t inputs() const { return inputs_; }
  std::size_t uniforms() const { return uniforms_; }
  std::size_t outputs() const { return outputs_; }
  std::size_t registers() const { return registers_; }
  /// Whether an output jumps: sign, step or a condition of something that differs from node to node.
  bool jumps() const;
  std::size_t instructions() const { return program_.size(); }  ///< run for every block of nodes
  std::size_t uniform_instructions() const { return uniform_program_.size(); }  ///< run once per call

  /// inputs: one array of `nodes` values per node input; uniforms: values shared by all nodes; outputs: one
  /// array of `nodes` values per expression, distinct from each other and from the inputs. A node's value
  /// depends on its inputs and the uniforms alone, bit for bit, wherever it sits. No allocation after the
  /// first call on a thread.
  void evaluate(std::span<const double* const> inputs, std::span<const double> uniforms,
                std::span<double* const> outputs, std::size_t nodes) const;
  /// The same by a machine code chosen by the caller instead of the best one, for comparisons.
  void evaluate(const TapeKernel& kernel, std::span<const double* const> inputs,
                std::span<const double> uniforms, std::span<double* const> outputs, std::size_t nodes) const;

 private:
  friend class TapeCompiler;
  /// scalars[target] = op(scalars[a], scalars[b])
  struct UniformInstruction {
    Op op;
    std::uint32_t target, a, b;
  };

  std::size_t inputs_ = 0, uniforms_ = 0, outputs_ = 0, registers_ = 0;
  /// Scalars of a call, in this order: the uniforms, the constants, the values of the uniform program.
  std::vector<double> constants_;
  std::size_t scalars_ = 0;
  std::vector<UniformInstruction> uniform_program_;
  /// Slots of a block, in this order: the inputs, the outputs, the registers.
  std::vector<TapeInstruction> program_;
};

/// Builds a tape: equal subexpressions are shared over all outputs, constants folded, what depends on
/// uniforms alone is evaluated once per call, registers reused.
///
/// Values are simplified as they are made: x+0, x*1, x*0 = 0, x-x = 0, signs moved outwards, x^n for
/// half-integer n of small size by multiplications, sqrt and a reciprocal, factors that are constant or
/// uniform collected. These hold in real arithmetic; rounding may differ from the literal expression by a few
/// units in the last place, and 0 times a NaN is 0.
class TapeBuilder {
 public:
  /// Handle of a value of this builder.
  using Value = std::uint32_t;

  TapeBuilder(std::size_t inputs, std::size_t uniforms);
  Value input(std::size_t i);    ///< @pre i < inputs
  Value uniform(std::size_t i);  ///< @pre i < uniforms
  Value constant(double c);
  Value unary(Op op, Value a);            ///< @pre !is_binary(op)
  Value binary(Op op, Value a, Value b);  ///< @pre is_binary(op)
  /// The number that `v` is, if its simplification made it one.
  std::optional<double> constant_value(Value v) const;
  /// The tape of these values, in this order; a value may occur several times.
  Tape finish(std::span<const Value> outputs) const;

 private:
  friend class TapeCompiler;
  enum class Kind : std::uint8_t { input, uniform, constant, operation };
  struct Node {
    Kind kind;
    Op op;             // of an operation
    bool shared;       // the same for all nodes of a batch: a constant, a uniform, or made of such
    Value a, b;        // operands, b == a for unary operations; the index of an input or uniform
    double value = 0;  // of a constant
  };
  struct Key {
    std::uint64_t what, operands;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const;
  };

  Value intern(const Node& node);
  Value operation(Op op, Value a, Value b);
  Value sum(Value a, Value b);
  Value difference(Value a, Value b);
  Value product(Value a, Value b);
  Value quotient(Value a, Value b);
  Value power(Value a, Value b);
  Value positive_integer_power(Value a, unsigned n);
  Value negative(Value a);

  const Node& at(Value v) const { return nodes_[v]; }
  bool is_constant(Value v) const { return at(v).kind == Kind::constant; }
  bool is_constant(Value v, double c) const { return is_constant(v) && at(v).value == c; }
  bool is_operation(Value v, Op op) const { return at(v).kind == Kind::operation && at(v).op == op; }

  std::size_t inputs_, uniforms_;
  std::vector<Node> nodes_;  // operands come before the operations on them
  std::unordered_map<Key, Value, KeyHash> known_;
};

}  // namespace wienertree
