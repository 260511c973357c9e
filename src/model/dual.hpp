#pragma once
/// Forward-mode automatic differentiation: a value with its derivatives in n directions.
///
///     (a, a') op (b, b') = (a op b, d_1 op(a, b) a' + d_2 op(a, b) b')
///
/// (Griewank, Walther 2008, Evaluating Derivatives, chapter 3). The scalar S is `double`, another Dual (then
/// second derivatives come out) or Recorded. A direction in which an argument does not change stays zero,
/// even where the derivative of a function is infinite: sqrt(v) at v = 0 has slope 0 along s.
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>

#include "wienertree/model/scalar_functions.hpp"

namespace wienertree {

template <class S, std::size_t n>
class Dual {
 public:
  S value{};
  [[no_unique_address]] std::array<S, n> slopes{};

  Dual() = default;
  Dual(double constant) : value(constant) {}  // NOLINT: a number is a constant
  Dual(const S& constant) requires(!std::same_as<S, double>) : value(constant) {}  // NOLINT
  Dual(const S& value_, const std::array<S, n>& slopes_) : value(value_), slopes(slopes_) {}

  friend Dual operator+(const Dual& a) { return a; }
  friend Dual operator-(const Dual& a) {
    Dual result(-a.value);
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = -a.slopes[l];
    return result;
  }
  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual result(a.value + b.value);
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = a.slopes[l] + b.slopes[l];
    return result;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual result(a.value - b.value);
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = a.slopes[l] - b.slopes[l];
    return result;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return of(a.value * b.value, b.value, a, a.value, b);
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const S quotient = a.value / b.value;
    return of(quotient, 1.0 / b.value, a, -quotient / b.value, b);
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend bool operator!=(const Dual& a, const Dual& b) { return a.value != b.value; }
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }

  friend Dual weighted(const Dual& w, const Dual& s) {
    using scalar::weighted;
    Dual result(weighted(w.value, s.value));
    for (std::size_t l = 0; l < n; ++l)
      result.slopes[l] = weighted(w.value, s.slopes[l]) + weighted(w.slopes[l], s.value);
    return result;
  }

// f(a) and its slope for every elementary function.
#define X(operation, name, algebra, machine, derivative) \
  friend Dual name(const Dual& a) {                      \
    using namespace scalar;                              \
    [[maybe_unused]] const S& x = a.value;               \
    const S y = name(x);                                 \
    return of(y, derivative, a);                         \
  }
  WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
  friend Dual pow(const Dual& a, double exponent) {
    using std::pow;
    if (exponent == 0.0) return Dual(1.0);
    return of(pow(a.value, exponent), exponent * pow(a.value, exponent - 1.0), a);
  }
  friend Dual pow(const Dual& a, const Dual& b) {
    using std::log, std::pow;
    const S y = pow(a.value, b.value);
    return of(y, b.value * pow(a.value, b.value - 1.0), a, y * log(a.value), b);
  }
  /// Their derivative is taken to be 0, also where they jump.
  friend Dual sign(const Dual& a) {
    using scalar::sign;
    return Dual(sign(a.value));
  }
  friend Dual step(const Dual& a) {
    using scalar::step;
    return Dual(step(a.value));
  }
  /// The condition itself is taken to have derivative 0.
  friend Dual where(const Dual& condition, const Dual& b) {
    using scalar::where;
    Dual result(where(condition.value, b.value));
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = where(condition.value, b.slopes[l]);
    return result;
  }
  friend Dual unless(const Dual& condition, const Dual& b) {
    using scalar::unless;
    Dual result(unless(condition.value, b.value));
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = unless(condition.value, b.slopes[l]);
    return result;
  }
  friend Dual abs(const Dual& a) {
    using scalar::sign, std::abs;
    return of(abs(a.value), sign(a.value), a);
  }
  /// At equal values the slope of the first.
  friend Dual min(const Dual& a, const Dual& b) {
    using scalar::min, scalar::step;
    const S second = step(a.value - b.value);
    return of(min(a.value, b.value), 1.0 - second, a, second, b);
  }
  friend Dual max(const Dual& a, const Dual& b) {
    using scalar::max, scalar::step;
    const S second = step(b.value - a.value);
    return of(max(a.value, b.value), 1.0 - second, a, second, b);
  }

 private:
  /// f(a) with f' = da.
  static Dual of(const S& y, const S& da, const Dual& a) {
    using scalar::weighted;
    Dual result(y);
    for (std::size_t l = 0; l < n; ++l) result.slopes[l] = weighted(da, a.slopes[l]);
    return result;
  }
  static Dual of(const S& y, const S& da, const Dual& a, const S& db, const Dual& b) {
    using scalar::weighted;
    Dual result(y);
    for (std::size_t l = 0; l < n; ++l)
      result.slopes[l] = weighted(da, a.slopes[l]) + weighted(db, b.slopes[l]);
    return result;
  }
};

}  // namespace wienertree
