#pragma once
/// Expressions compiled to a register tape, evaluated over blocks of nodes with vectorised elementary functions.
#include <cstdint>
#include <span>
#include <vector>

namespace wienertree {

enum class Op : std::uint8_t {
  add, subtract, multiply, divide, negate, power, minimum, maximum,
  absolute, sign, step,  // step(x) = 1 for x > 0, else 0
  square_root, exponential, logarithm, sine, cosine, tangent, hyperbolic_sine, hyperbolic_cosine, hyperbolic_tangent,
  arctangent, error_function, error_function_complement,
};

/// A compiled list of expressions. Immutable and thread-safe.
class Tape {
 public:
  /// inputs: one array of `nodes` values per node input; uniforms: values shared by all nodes; outputs: one array of
  /// `nodes` values per expression, distinct from the inputs. A node's value depends on its inputs alone, bit for bit,
  /// wherever it sits. No allocation after the first call on a thread.
  void evaluate(std::span<const double* const> inputs, std::span<const double> uniforms,
                std::span<double* const> outputs, std::size_t nodes) const;

 private:
  friend class TapeBuilder;
};

/// Builds a tape: equal subexpressions are shared over all outputs, constants folded, what depends on uniforms alone is
/// evaluated once per call, registers reused.
class TapeBuilder {
 public:
  using Value = std::uint32_t;
  TapeBuilder(std::size_t inputs, std::size_t uniforms);
  Value input(std::size_t i);
  Value uniform(std::size_t i);
  Value constant(double c);
  Value unary(Op op, Value a);
  Value binary(Op op, Value a, Value b);
  Tape finish(std::span<const Value> outputs);
};

}  // namespace wienertree
