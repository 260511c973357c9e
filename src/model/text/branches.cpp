#include "wienertree/model/text/branches.hpp"

#include <algorithm>
#include <unordered_map>

namespace wienertree::text {
namespace {

bool has_kink(Expression e) {
  if (e->kind != Node::Kind::function) return false;
  return e->op == Op::absolute || e->op == Op::maximum || e->op == Op::minimum || e->op == Op::sign ||
         e->op == Op::step;
}

/// Rebuilds an expression from the leaves upwards; what has a kink is rebuilt by `Kinks::rebuilt`.
template <class Kinks>
class Rebuilding {
 public:
  Rebuilding(Arena& arena, Kinks& kinks) : arena_(arena), kinks_(kinks) {}

  Expression operator()(Expression e) {
    if (const auto found = done_.find(e); found != done_.end()) return found->second;
    const Expression result = rebuilt(e);
    done_.emplace(e, result);
    return result;
  }

 private:
  Expression rebuilt(Expression e) {
    if (e->operands.empty()) return e;
    std::vector<Expression> operands;
    for (Expression operand : e->operands) operands.push_back((*this)(operand));
    switch (e->kind) {
      case Node::Kind::power:
        return arena_.power(operands[0], operands[1]);
      case Node::Kind::product:
        return arena_.product(std::move(operands));
      case Node::Kind::sum:
        return arena_.sum(std::move(operands));
      default:
        break;
    }
    if (!has_kink(e)) return arena_.function(e->op, std::move(operands));
    return kinks_.rebuilt(e, std::move(operands));
  }

  Arena& arena_;
  Kinks& kinks_;
  std::unordered_map<Expression, Expression> done_;
};

Expression times(Arena& arena, double c, Expression e) { return arena.product({arena.number(c), e}); }
Expression minus(Arena& arena, Expression a, Expression b) { return arena.sum({a, times(arena, -1, b)}); }

/// The argument that passes through 0: a - b for max and min.
Expression argument_of(Arena& arena, const std::vector<Expression>& operands) {
  return operands.size() == 2 ? minus(arena, operands[0], operands[1]) : operands[0];
}

struct IntoBranches {
  Arena& arena;
  std::vector<Expression> arguments = {}, exact = {};

  Expression rebuilt(Expression e, std::vector<Expression> operands) {
    const Expression as_written = argument_of(arena, e->operands), u = argument_of(arena, operands);
    const auto known = std::find(exact.begin(), exact.end(), as_written);
    const auto k = static_cast<std::size_t>(known - exact.begin());
    if (known == exact.end()) {
      exact.push_back(as_written);
      arguments.push_back(u);
    }
    const Expression above = arena.symbol(Role::observation, k, "above");
    const Expression side = arena.sum({times(arena, 2, above), arena.number(-1)});
    switch (e->op) {
      case Op::maximum:
        return arena.sum({operands[1], arena.product({above, u})});
      case Op::minimum:
        return arena.sum({operands[0], times(arena, -1, arena.product({above, u}))});
      case Op::absolute:
        return arena.product({side, u});
      case Op::sign:
        return side;
      default:
        return above;
    }
  }
};

struct WithArgument {
  Arena& arena;
  Expression exact;

  Expression rebuilt(Expression e, std::vector<Expression> operands) {
    if (argument_of(arena, e->operands) != exact) return arena.function(e->op, std::move(operands));
    const Expression u = arena.symbol(Role::observation, 0, "argument");
    const auto positive = [&] { return arena.function(Op::maximum, {u, arena.number(0)}); };
    switch (e->op) {
      case Op::maximum:
        return arena.sum({operands[1], positive()});
      case Op::minimum:
        return arena.sum({operands[0], times(arena, -1, positive())});
      default:
        return arena.function(e->op, {u});
    }
  }
};

}  // namespace

Branches branches_of(Expression e, Arena& arena) {
  IntoBranches kinks{arena};
  const Expression value = Rebuilding<IntoBranches>(arena, kinks)(e);
  return {value, std::move(kinks.arguments), std::move(kinks.exact)};
}

Expression with_argument(Expression e, Expression exact, Arena& arena) {
  WithArgument kinks{arena, exact};
  return Rebuilding<WithArgument>(arena, kinks)(e);
}

}  // namespace wienertree::text
