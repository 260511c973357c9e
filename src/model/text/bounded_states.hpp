#pragma once
/// The states on a tape, moved inside their bounds where the model says so.
#include <cmath>
#include <vector>

#include "wienertree/model/model.hpp"
#include "wienertree/model/text/expression.hpp"

namespace wienertree::text {

/// Inputs from first_column on are the columns of the functions of time: t is read there, not off the clock.
inline void take_columns(TapeSymbols& symbols, TapeBuilder& builder, const InputFunctions& known,
                         std::size_t first_column) {
  symbols.states.back() = builder.input(first_column);
  for (std::size_t c = 1; c < known.columns(); ++c) symbols.inputs.push_back(builder.input(first_column + c));
}

/// Inputs 0 .. d-1 of the tape are the states.
class BoundedStates {
 public:
  /// known: the model's functions of time, or null; their columns are the tape's inputs from first_column on.
  BoundedStates(const std::vector<StateBound>& bounds, TapeBuilder& builder, const InputFunctions* known,
                std::size_t first_column)
      : bounds_(bounds), builder_(builder) {
    for (std::size_t i = 0; i < bounds.size(); ++i) {
      const Value x = builder.input(i);
      const Value one = builder.constant(1);
      symbols_.states.push_back(moved_inside(i, x));
      alive_.push_back(one);
      slope_.push_back(one);
      if (!moves(i)) continue;
      if (std::isfinite(bounds[i].lower)) {
        const Value lower = builder.constant(bounds[i].lower);
        multiply(slope_[i], builder.binary(Op::subtract, one, positive(lower, x)));
        if (bounds[i].boundary == Boundary::absorb) multiply(alive_[i], positive(x, lower));
      }
      if (std::isfinite(bounds[i].upper)) {
        const Value upper = builder.constant(bounds[i].upper);
        multiply(slope_[i], builder.binary(Op::subtract, one, positive(x, upper)));
        if (bounds[i].boundary == Boundary::absorb) multiply(alive_[i], positive(upper, x));
      }
    }
    if (known != nullptr) take_columns(symbols_, builder, *known, first_column);
  }

  using Value = TapeBuilder::Value;
  /// At the nearest point inside.
  const TapeSymbols& symbols() const { return symbols_; }
  /// 0 where component i is absorbed, else 1.
  Value alive(std::size_t i) const { return alive_[i]; }
  /// Derivative of the nearest point inside with respect to x_i: 1 inside (ends included), 0 outside.
  Value slope(std::size_t i) const { return slope_[i]; }
  /// `value` moved to the nearest point of component i's bounds.
  Value moved_inside(std::size_t i, Value value) const {
    if (!moves(i)) return value;
    if (std::isfinite(bounds_[i].lower))
      value = builder_.binary(Op::maximum, value, builder_.constant(bounds_[i].lower));
    if (std::isfinite(bounds_[i].upper))
      value = builder_.binary(Op::minimum, value, builder_.constant(bounds_[i].upper));
    return value;
  }

 private:
  bool moves(std::size_t i) const { return bounds_[i].bounded() && bounds_[i].boundary != Boundary::error; }
  Value positive(Value a, Value b) { return builder_.unary(Op::step, builder_.binary(Op::subtract, a, b)); }
  void multiply(Value& product, Value factor) { product = builder_.binary(Op::multiply, product, factor); }

  const std::vector<StateBound>& bounds_;
  TapeBuilder& builder_;
  TapeSymbols symbols_;
  std::vector<Value> alive_, slope_;
};

}  // namespace wienertree::text
