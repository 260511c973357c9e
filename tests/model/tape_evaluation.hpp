#pragma once
/// What the tests of the expression tape share.
#include <cstring>
#include <random>
#include <span>
#include <vector>

#include "wienertree/model/tape.hpp"

namespace wienertree::test {

using Columns = std::vector<std::vector<double>>;  // one column of `nodes` values per input or output

inline std::span<const TapeKernel> kernels() {
  const TapeKernels table = tape_kernels();
  return {table.kernels, table.count};
}

inline Columns evaluate(const TapeKernel& kernel, const Tape& tape, const Columns& inputs,
                        std::span<const double> uniforms, std::size_t nodes) {
  Columns outputs(tape.outputs(), std::vector<double>(nodes));
  std::vector<const double*> in;
  std::vector<double*> out;
  for (const auto& column : inputs) in.push_back(column.data());
  for (auto& column : outputs) out.push_back(column.data());
  tape.evaluate(kernel, in, uniforms, out, nodes);
  return outputs;
}

inline bool same_bytes(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// The operations of one argument, and of two.
#define X(name, ...) Op::name,
inline constexpr Op unary_operations[] = {WIENERTREE_TAPE_UNARY(X) WIENERTREE_ELEMENTARY_FUNCTIONS(X)};
inline constexpr Op binary_operations[] = {WIENERTREE_TAPE_BINARY(X)};
#undef X

/// Numbers where elementary functions change their course: ends of ranges, signed zeros, subnormals,
/// infinities, NaN.
inline const std::vector<double>& special_values() {
  static const std::vector<double> values = [] {
    std::vector<double> v = {0.0,
                             0x1p-1074,
                             1e-320,
                             0x1p-1022,
                             1e-300,
                             1e-160,
                             1e-8,
                             0.3466,
                             0.5,
                             1.0,
                             1.5707963267948966,
                             3.141592653589793,
                             5.9,
                             6.0,
                             19.0,
                             19.1,
                             20.0,
                             26.5,
                             27.2,
                             28.0,
                             40.0,
                             350.0,
                             700.0,
                             708.4,
                             709.7,
                             709.79,
                             710.0,
                             710.4,
                             710.5,
                             745.1,
                             745.2,
                             746.0,
                             800.0,
                             1e5,
                             1e10,
                             1e15,
                             1e22,
                             1e300,
                             1e308,
                             __builtin_inf()};
    for (std::size_t i = 0, n = v.size(); i < n; ++i) v.push_back(-v[i]);
    v.push_back(__builtin_nan(""));
    return v;
  }();
  return values;
}

}  // namespace wienertree::test
