#pragma once
/// The functions of the model language.
#include <array>
#include <string_view>

#include "wienertree/model/tape.hpp"

namespace wienertree::text {

struct FunctionName {
  std::string_view name;
  Op op;
  std::size_t arguments;
};

/// Those a user may write.
inline constexpr std::array<FunctionName, 14> function_names{{
    {"exp", Op::exponential, 1},
    {"log", Op::logarithm, 1},
    {"sqrt", Op::square_root, 1},
    {"sin", Op::sine, 1},
    {"cos", Op::cosine, 1},
    {"tan", Op::tangent, 1},
    {"sinh", Op::hyperbolic_sine, 1},
    {"cosh", Op::hyperbolic_cosine, 1},
    {"tanh", Op::hyperbolic_tangent, 1},
    {"atan", Op::arctangent, 1},
    {"erf", Op::error_function, 1},
    {"abs", Op::absolute, 1},
    {"min", Op::minimum, 2},
    {"max", Op::maximum, 2},
}};

/// Also names what derivatives bring: the derivative of abs is sign, that of min and max is made of
/// step(x) = 1 for x > 0, else 0.
constexpr std::string_view function_name(Op op) {
  for (const FunctionName& function : function_names)
    if (function.op == op) return function.name;
  return op == Op::sign ? "sign" : op == Op::step ? "step" : "?";
}

}  // namespace wienertree::text
