#pragma once
/// A number that writes down what is done with it: arithmetic on Recorded values becomes a tape.
///
/// A Recorded value has no number to branch on. `if (x > 0)` does not compile; use min, max, abs, sign, step.
#include "wienertree/model/tape.hpp"

namespace wienertree {

class Recorded {
 public:
  Recorded(double constant = 0.0) : constant_(constant) {}  // NOLINT: a number is a constant
  /// Value `value` of a tape being built; the builder must outlive what is made of it.
  Recorded(TapeBuilder& builder, TapeBuilder::Value value) : builder_(&builder), value_(value) {
    if (const auto number = builder.constant_value(value)) *this = Recorded(*number);
  }

  bool is_constant() const { return builder_ == nullptr; }
  bool is_constant(double c) const { return is_constant() && constant_ == c; }
  /// @pre is_constant()
  double constant() const { return constant_; }
  /// This value on the tape being built by `builder`. @pre is_constant(), or recorded there
  TapeBuilder::Value on(TapeBuilder& builder) const {
    return is_constant() ? builder.constant(constant_) : value_;
  }

  friend Recorded operator+(const Recorded& a) { return a; }
  friend Recorded operator-(const Recorded& a) { return record(Op::negate, a); }
  friend Recorded operator+(const Recorded& a, const Recorded& b) { return record(Op::add, a, b); }
  friend Recorded operator-(const Recorded& a, const Recorded& b) { return record(Op::subtract, a, b); }
  friend Recorded operator*(const Recorded& a, const Recorded& b) { return record(Op::multiply, a, b); }
  friend Recorded operator/(const Recorded& a, const Recorded& b) { return record(Op::divide, a, b); }
  Recorded& operator+=(const Recorded& b) { return *this = *this + b; }
  Recorded& operator-=(const Recorded& b) { return *this = *this - b; }
  Recorded& operator*=(const Recorded& b) { return *this = *this * b; }
  Recorded& operator/=(const Recorded& b) { return *this = *this / b; }

#define X(operation, name, ...) \
  friend Recorded name(const Recorded& a) { return record(Op::operation, a); }
  WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
  friend Recorded abs(const Recorded& a) { return record(Op::absolute, a); }
  friend Recorded sign(const Recorded& a) { return record(Op::sign, a); }
  friend Recorded step(const Recorded& a) { return record(Op::step, a); }
  friend Recorded pow(const Recorded& a, const Recorded& b) { return record(Op::power, a, b); }
  friend Recorded min(const Recorded& a, const Recorded& b) { return record(Op::minimum, a, b); }
  friend Recorded max(const Recorded& a, const Recorded& b) { return record(Op::maximum, a, b); }
  /// b where the condition is not 0, else 0, whatever b is there; `unless`: where it is 0.
  friend Recorded where(const Recorded& condition, const Recorded& b) {
    return record(Op::where, condition, b);
  }
  friend Recorded unless(const Recorded& condition, const Recorded& b) {
    return record(Op::unless, condition, b);
  }
  friend Recorded weighted(const Recorded& weight, const Recorded& slope) {
    return slope.is_constant(0.0) ? slope : weight * slope;
  }

  template <class T>
  friend bool operator<(const Recorded&, const T&) {
    return no_branch<T>();
  }
  template <class T>
  friend bool operator>(const Recorded&, const T&) {
    return no_branch<T>();
  }
  template <class T>
  friend bool operator<=(const Recorded&, const T&) {
    return no_branch<T>();
  }
  template <class T>
  friend bool operator>=(const Recorded&, const T&) {
    return no_branch<T>();
  }
  template <class T>
  friend bool operator==(const Recorded&, const T&) {
    return no_branch<T>();
  }
  template <class T>
  friend bool operator!=(const Recorded&, const T&) {
    return no_branch<T>();
  }

 private:
  template <class T>
  static bool no_branch() {
    static_assert(sizeof(T) == 0,
                  "a recorded model cannot branch on its state: use min, max, abs, sign, step, or declare "
                  "`static constexpr bool branches = true` in the model");
    return false;
  }
  static Recorded record(Op op, const Recorded& a) {
    if (a.is_constant()) return Recorded(apply(op, a.constant_));
    return {*a.builder_, a.builder_->unary(op, a.value_)};
  }
  static Recorded record(Op op, const Recorded& a, const Recorded& b) {
    if (a.is_constant() && b.is_constant()) return Recorded(apply(op, a.constant_, b.constant_));
    TapeBuilder& builder = a.is_constant() ? *b.builder_ : *a.builder_;
    return {builder, builder.binary(op, a.on(builder), b.on(builder))};
  }

  TapeBuilder* builder_ = nullptr;  // null: the constant
  TapeBuilder::Value value_ = 0;
  double constant_ = 0;
};

}  // namespace wienertree
