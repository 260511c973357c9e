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

/// Those a user may write, besides if(condition, a, b), which is where(condition, a) + unless(condition, b).
#define X(operation, name, ...) {#name, Op::operation, 1},
inline constexpr auto function_names = std::to_array<FunctionName>({
    WIENERTREE_ELEMENTARY_FUNCTIONS(X)  //
    {"abs", Op::absolute, 1},
    {"sign", Op::sign, 1},
    {"min", Op::minimum, 2},
    {"max", Op::maximum, 2},
});
#undef X

/// Words that are part of the language and cannot be names.
inline constexpr std::array<std::string_view, 4> reserved_words{"if", "and", "or", "not"};

constexpr std::string_view function_name(Op op) {
  for (const FunctionName& function : function_names)
    if (function.op == op) return function.name;
  return "?";
}

}  // namespace wienertree::text
