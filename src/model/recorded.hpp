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

  friend Recorded exp(const Recorded& a) { return record(Op::exponential, a); }
  friend Recorded log(const Recorded& a) { return record(Op::logarithm, a); }
  friend Recorded sqrt(const Recorded& a) { return record(Op::square_root, a); }
  friend Recorded sin(const Recorded& a) { return record(Op::sine, a); }
  friend Recorded cos(const Recorded& a) { return record(Op::cosine, a); }
  friend Recorded tan(const Recorded& a) { return record(Op::tangent, a); }
  friend Recorded sinh(const Recorded& a) { return record(Op::hyperbolic_sine, a); }
  friend Recorded cosh(const Recorded& a) { return record(Op::hyperbolic_cosine, a); }
  friend Recorded tanh(const Recorded& a) { return record(Op::hyperbolic_tangent, a); }
  friend Recorded atan(const Recorded& a) { return record(Op::arctangent, a); }
  friend Recorded erf(const Recorded& a) { return record(Op::error_function, a); }
  friend Recorded erfc(const Recorded& a) { return record(Op::error_function_complement, a); }
  friend Recorded abs(const Recorded& a) { return record(Op::absolute, a); }
  friend Recorded sign(const Recorded& a) { return record(Op::sign, a); }
  friend Recorded step(const Recorded& a) { return record(Op::step, a); }
  friend Recorded pow(const Recorded& a, const Recorded& b) { return record(Op::power, a, b); }
  friend Recorded min(const Recorded& a, const Recorded& b) { return record(Op::minimum, a, b); }
  friend Recorded max(const Recorded& a, const Recorded& b) { return record(Op::maximum, a, b); }
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
