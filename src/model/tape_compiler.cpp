// From values to a program: fusing, order, registers.
#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

#include "wienertree/model/tape.hpp"

namespace wienertree {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// How many of an instruction's operands are values, and which of the last ones are shared (scalars).
TapeCode with_operands(TapeCode first, unsigned form) {
  return static_cast<TapeCode>(static_cast<unsigned>(first) + form);
}

TapeCode first_code(Op op) {
  constexpr std::array codes{
#define X(name) TapeCode::name##_vv,
      WIENERTREE_TAPE_BINARY(X)
#undef X
#define X(name, ...) TapeCode::name##_v,
          WIENERTREE_TAPE_UNARY(X) WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
  };
  return codes[static_cast<std::size_t>(op)];
}

}  // namespace

class TapeCompiler {
 public:
  using Value = TapeBuilder::Value;
  TapeCompiler(const TapeBuilder& values, std::span<const Value> outputs)
      : values_(values), outputs_(outputs), uses_(values.nodes_.size(), 0), steps_(values.nodes_.size()) {}

  Tape compile() {
    tape_.inputs_ = values_.inputs_;
    tape_.uniforms_ = values_.uniforms_;
    tape_.outputs_ = outputs_.size();
    count_uses();
    place_shared_values();
    for (Value v = 0; v < values_.nodes_.size(); ++v)
      if (runs_per_node(v)) steps_[v] = unfused(v);
    fuse();
    order();
    allocate();
    return std::move(tape_);
  }

 private:
  /// An operation on values: `first` is its code with operands that are all per node.
  struct Step {
    TapeCode first{};
    std::array<Value, 3> operands{none, none, none};
    std::span<const Value> used() const {
      return {operands.data(),
              static_cast<std::size_t>(std::find(operands.begin(), operands.end(), none) - operands.begin())};
    }
  };

  const TapeBuilder::Node& at(Value v) const { return values_.at(v); }
  bool is_operation(Value v) const { return at(v).kind == TapeBuilder::Kind::operation; }
  bool is_shared(Value v) const { return at(v).shared; }
  bool runs_per_node(Value v) const { return uses_[v] != 0 && is_operation(v) && !is_shared(v); }

  Step unfused(Value v) const {
    const auto& node = at(v);
    Step step{first_code(node.op), {node.a, none, none}};
    if (is_binary(node.op)) step.operands[1] = node.b;
    return step;
  }

  /// Occurrences among the outputs and as operands of values that are used; 0 for what no output needs.
  void count_uses() {
    for (const Value v : outputs_) ++uses_[v];
    for (Value v = static_cast<Value>(values_.nodes_.size()); v-- > 0;) {  // operands come before operations
      if (uses_[v] == 0 || !is_operation(v)) continue;
      ++uses_[at(v).a];
      if (is_binary(at(v).op)) ++uses_[at(v).b];
    }
  }

  void place_shared_values() {
    scalar_.assign(values_.nodes_.size(), none);
    auto next = static_cast<std::uint32_t>(values_.uniforms_);
    for (Value v = 0; v < values_.nodes_.size(); ++v) {
      if (uses_[v] == 0) continue;
      if (at(v).kind == TapeBuilder::Kind::uniform) scalar_[v] = at(v).a;
      if (at(v).kind == TapeBuilder::Kind::constant) {
        scalar_[v] = next++;
        tape_.constants_.push_back(at(v).value);
      }
    }
    for (Value v = 0; v < values_.nodes_.size(); ++v) {
      if (uses_[v] == 0 || !is_operation(v) || !is_shared(v)) continue;
      scalar_[v] = next++;
      tape_.uniform_program_.push_back({at(v).op, scalar_[v], scalar_[at(v).a], scalar_[at(v).b]});
    }
    tape_.scalars_ = next;
  }

  /// Drops value v, used only by the operation it was merged into.
  void absorb(Value v) { uses_[v] = 0; }

  bool single_use(Value v, Op op) const { return runs_per_node(v) && at(v).op == op && uses_[v] == 1; }

  /// x (1/y) -> x/y, then a b + c, a b - c and c - a b as one instruction each, where the inner value serves
  /// nothing else.
  void fuse() {
    const auto count = static_cast<Value>(values_.nodes_.size());
    for (Value v = 0; v < count; ++v) {
      if (!runs_per_node(v) || at(v).op != Op::multiply) continue;
      for (const auto& [x, reciprocal] : {std::pair{at(v).a, at(v).b}, std::pair{at(v).b, at(v).a}}) {
        if (!single_use(reciprocal, Op::divide) || !values_.is_constant(at(reciprocal).a, 1.0)) continue;
        steps_[v] = {TapeCode::divide_vv, {x, at(reciprocal).b, none}};
        absorb(reciprocal);
        break;
      }
    }
    for (Value v = 0; v < count; ++v) {
      if (!runs_per_node(v) || (at(v).op != Op::add && at(v).op != Op::subtract)) continue;
      const Value a = at(v).a, b = at(v).b;
      const auto is_free_product = [&](Value p) {
        return single_use(p, Op::multiply) && steps_[p].first == TapeCode::multiply_vv;
      };
      if (is_free_product(a)) {
        const TapeCode code =
            at(v).op == Op::add ? TapeCode::multiply_add_vvv : TapeCode::multiply_subtract_vvv;
        steps_[v] = {code, {steps_[a].operands[0], steps_[a].operands[1], b}};
        absorb(a);
      } else if (is_free_product(b)) {
        const TapeCode code =
            at(v).op == Op::add ? TapeCode::multiply_add_vvv : TapeCode::negative_multiply_add_vvv;
        steps_[v] = {code, {steps_[b].operands[0], steps_[b].operands[1], a}};
        absorb(b);
      }
    }
  }

  /// Depth first from the outputs; of an operation's operands the one that needs more registers goes first
  /// (Sethi, Ullman 1970, J. ACM 17, 715-728), which is optimal for trees and a good rule for graphs.
  void order() {
    const auto count = static_cast<Value>(values_.nodes_.size());
    std::vector<std::uint32_t> need(count, 0);
    const auto by_need = [&](const Step& step) {
      std::array<Value, 3> operands{};
      const auto used = step.used();
      const auto end =
          std::copy_if(used.begin(), used.end(), operands.begin(), [&](Value o) { return runs_per_node(o); });
      std::stable_sort(operands.begin(), end, [&](Value x, Value y) { return need[x] > need[y]; });
      return std::pair{operands, static_cast<std::size_t>(end - operands.begin())};
    };
    for (Value v = 0; v < count; ++v) {
      if (!runs_per_node(v)) continue;
      const auto [operands, n] = by_need(steps_[v]);
      std::uint32_t most = 1;
      for (std::uint32_t i = 0; i < n; ++i) most = std::max(most, need[operands[i]] + i);
      need[v] = most;
    }
    std::vector<bool> done(count, false);
    std::vector<std::pair<Value, bool>> stack;  // a value, and whether its operands have been pushed
    for (const Value output : outputs_) {
      if (runs_per_node(output)) stack.emplace_back(output, false);
      while (!stack.empty()) {
        const auto [v, expanded] = stack.back();
        stack.pop_back();
        if (done[v]) continue;
        if (expanded) {
          done[v] = true;
          order_.push_back(v);
          continue;
        }
        stack.emplace_back(v, true);
        const auto [operands, n] = by_need(steps_[v]);
        for (std::size_t i = n; i-- > 0;)
          if (!done[operands[i]]) stack.emplace_back(operands[i], false);
      }
    }
  }

  /// Linear scan: an output is computed in place, any other value in the register freed last. A value that
  /// dies here may give its register to the result, since an instruction reads a vector before it writes it.
  void allocate() {
    const auto count = static_cast<Value>(values_.nodes_.size());
    const auto first_output = static_cast<std::uint32_t>(values_.inputs_);
    const auto first_register = static_cast<std::uint32_t>(values_.inputs_ + outputs_.size());
    std::vector<std::uint32_t> slot(count, none), last(count, 0), free;
    for (Value v = 0; v < count; ++v)
      if (at(v).kind == TapeBuilder::Kind::input) slot[v] = at(v).a;
    for (std::uint32_t o = 0; o < outputs_.size(); ++o)
      if (slot[outputs_[o]] == none && runs_per_node(outputs_[o])) slot[outputs_[o]] = first_output + o;
    for (std::uint32_t i = 0; i < order_.size(); ++i)
      for (const Value operand : steps_[order_[i]].used()) last[operand] = i;

    std::uint32_t registers = 0;
    for (std::uint32_t i = 0; i < order_.size(); ++i) {
      const Value v = order_[i];
      const auto operands = steps_[v].used();
      for (std::size_t k = 0; k < operands.size(); ++k) {
        const Value operand = operands[k];
        const bool repeated = std::find(operands.begin(), operands.begin() + static_cast<std::ptrdiff_t>(k),
                                        operand) != operands.begin() + static_cast<std::ptrdiff_t>(k);
        if (!repeated && last[operand] == i && slot[operand] != none && slot[operand] >= first_register)
          free.push_back(slot[operand]);
      }
      if (slot[v] == none) {
        if (free.empty()) {
          slot[v] = first_register + registers++;
        } else {
          slot[v] = free.back();
          free.pop_back();
        }
      }
      tape_.program_.push_back(instruction(steps_[v], slot[v], slot));
    }
    for (std::uint32_t o = 0; o < outputs_.size(); ++o) {  // inputs, shared values and repeated outputs
      const Value v = outputs_[o];
      if (slot[v] == first_output + o) continue;
      if (is_shared(v))
        tape_.program_.push_back({TapeCode::copy_s, first_output + o, scalar_[v], 0, 0});
      else
        tape_.program_.push_back({TapeCode::copy_v, first_output + o, slot[v], 0, 0});
    }
    tape_.registers_ = registers;
  }

  TapeInstruction instruction(const Step& step, std::uint32_t target,
                              const std::vector<std::uint32_t>& slot) const {
    Step s = step;
    const std::size_t n = s.used().size();
    // a b + c with the scalar factor first is the same product with it second.
    if (n == 3 && is_shared(s.operands[0])) std::swap(s.operands[0], s.operands[1]);
    unsigned form = 0;
    if (n == 2) form = is_shared(s.operands[1]) ? 1 : is_shared(s.operands[0]) ? 2 : 0;
    if (n == 3) form = (is_shared(s.operands[2]) ? 1u : 0u) + (is_shared(s.operands[1]) ? 2u : 0u);
    const auto place = [&](std::size_t k) {
      if (k >= n) return 0u;
      return is_shared(s.operands[k]) ? scalar_[s.operands[k]] : slot[s.operands[k]];
    };
    return {with_operands(s.first, form), target, place(0), place(1), place(2)};
  }

  const TapeBuilder& values_;
  std::span<const Value> outputs_;
  std::vector<std::uint32_t> uses_;
  std::vector<Step> steps_;            // of the values that run per node
  std::vector<std::uint32_t> scalar_;  // place of a shared value
  std::vector<Value> order_;
  Tape tape_;
};

Tape TapeBuilder::finish(std::span<const Value> outputs) const {
  for ([[maybe_unused]] const Value v : outputs) assert(v < nodes_.size());
  return TapeCompiler(*this, outputs).compile();
}

}  // namespace wienertree
