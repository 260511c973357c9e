// The functions of the language in GiNaC. Elementary functions come from the table of
// elementary_functions.hpp; abs, sign, min, max, conditions are our own, with the derivatives
//
//   abs' = sign,   sign' = step' = 0,     step(x) = 1 for x > 0, else 0,
//   d min(a,b) = (1 - step(a-b)) da + step(a-b) db,
//   d max(a,b) = step(a-b) da + (1 - step(a-b)) db,
//   d where(c,a) = where(c, da),   d unless(c,a) = unless(c, da).
//
// GiNaC's abs is that of complex numbers, and it has no min or max.
#include <map>
#include <stdexcept>

#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

namespace {

using GiNaC::ex;
using GiNaC::numeric;

// GiNaC's serial number of each operation that is a function there.
struct Serials {
  std::map<Op, unsigned> of;
  std::map<unsigned, Op> operation;
};
const Serials& serials();

ex call(Op op, const ex& a) { return GiNaC::function(serials().of.at(op), a); }
ex call(Op op, const ex& a, const ex& b) { return GiNaC::function(serials().of.at(op), a, b); }
ex held(Op op, const ex& a) { return GiNaC::function(serials().of.at(op), a).hold(); }
ex held(Op op, const ex& a, const ex& b) { return GiNaC::function(serials().of.at(op), a, b).hold(); }

bool is_number(const ex& e) { return GiNaC::is_exactly_a<numeric>(e); }
const numeric& to_number(const ex& e) { return GiNaC::ex_to<numeric>(e); }

ex sign_eval(const ex& x) { return is_number(x) ? ex(to_number(x).csgn()) : held(Op::sign, x); }
ex step_eval(const ex& x) { return is_number(x) ? ex(to_number(x).csgn() > 0 ? 1 : 0) : held(Op::step, x); }
ex flat_derivative(const ex&, unsigned) { return 0; }

ex absolute_eval(const ex& x) { return is_number(x) ? to_number(x).csgn() * x : held(Op::absolute, x); }
ex absolute_derivative(const ex& x, unsigned) { return call(Op::sign, x); }

ex minimum_eval(const ex& a, const ex& b) {
  if (is_number(a) && is_number(b)) return to_number(a) < to_number(b) ? a : b;
  return held(Op::minimum, a, b);
}
ex minimum_derivative(const ex& a, const ex& b, unsigned by) {
  const ex second_is_less = call(Op::step, a - b);
  return by == 0 ? 1 - second_is_less : second_is_less;
}

ex maximum_eval(const ex& a, const ex& b) {
  if (is_number(a) && is_number(b)) return to_number(a) > to_number(b) ? a : b;
  return held(Op::maximum, a, b);
}
ex maximum_derivative(const ex& a, const ex& b, unsigned by) {
  const ex first_is_greater = call(Op::step, a - b);
  return by == 0 ? first_is_greater : 1 - first_is_greater;
}

// The value is not multiplied by a condition: 0 times infinity must not come out of the branch not taken.
ex where_eval(const ex& condition, const ex& a) {
  if (a.is_zero()) return 0;
  if (is_number(condition)) return condition.is_zero() ? ex(0) : a;
  return held(Op::where, condition, a);
}
ex where_derivative(const ex& condition, const ex& a, const GiNaC::symbol& s) {
  return call(Op::where, condition, a.diff(s));
}
ex unless_eval(const ex& condition, const ex& a) {
  if (a.is_zero()) return 0;
  if (is_number(condition)) return condition.is_zero() ? a : ex(0);
  return held(Op::unless, condition, a);
}
ex unless_derivative(const ex& condition, const ex& a, const GiNaC::symbol& s) {
  return call(Op::unless, condition, a.diff(s));
}

// The names in which the derivatives of the table are written.
namespace own {
using GiNaC::acosh, GiNaC::asinh, GiNaC::atanh, GiNaC::cosh, GiNaC::sinh, GiNaC::tanh;
using GiNaC::asin, GiNaC::acos, GiNaC::atan, GiNaC::cos, GiNaC::sin, GiNaC::tan;
using GiNaC::exp, GiNaC::log, GiNaC::sqrt;
ex digamma(const ex& x) { return call(Op::digamma, x); }
ex trigamma(const ex& x) { return call(Op::trigamma, x); }
[[noreturn]] ex tetragamma(const ex&) {
  throw std::domain_error("the third derivative of lgamma is not part of the language");
}
}  // namespace own

#define WIENERTREE_root(operation, name, derivative)
#define WIENERTREE_ginac(operation, name, derivative)
#define WIENERTREE_own(operation, name, derivative)                                      \
  ex operation##_eval(const ex& x) { return held(Op::operation, x); }                    \
  ex operation##_derivative(const ex& x, unsigned) {                                     \
    using namespace own;                                                                 \
    [[maybe_unused]] const ex inv_sqrtpi = GiNaC::power(GiNaC::Pi, numeric(-1, 2));      \
    [[maybe_unused]] const ex inv_sqrt2pi = GiNaC::power(2 * GiNaC::Pi, numeric(-1, 2)); \
    return derivative;                                                                   \
  }
#define X(operation, name, algebra, machine, derivative) WIENERTREE_##algebra(operation, name, derivative)
WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
#undef WIENERTREE_ginac
#undef WIENERTREE_own

const Serials& serials() {
  using GiNaC::function;
  using GiNaC::function_options;
  static const Serials registered = [] {
    Serials s;
    const auto add = [&s](Op op, unsigned serial) {
      s.of[op] = serial;
      s.operation[serial] = op;
    };
    const auto add_new = [&](Op op, const function_options& options) {
      add(op, function::register_new(options));
    };
    add_new(Op::absolute,
            function_options("wt_abs", 1).eval_func(absolute_eval).derivative_func(absolute_derivative));
    add_new(Op::sign, function_options("wt_sign", 1).eval_func(sign_eval).derivative_func(flat_derivative));
    add_new(Op::step, function_options("wt_step", 1).eval_func(step_eval).derivative_func(flat_derivative));
    add_new(Op::minimum,
            function_options("wt_min", 2).eval_func(minimum_eval).derivative_func(minimum_derivative));
    add_new(Op::maximum,
            function_options("wt_max", 2).eval_func(maximum_eval).derivative_func(maximum_derivative));
    add_new(Op::where,
            function_options("wt_where", 2).eval_func(where_eval).expl_derivative_func(where_derivative));
    add_new(Op::unless,
            function_options("wt_unless", 2).eval_func(unless_eval).expl_derivative_func(unless_derivative));
#define WIENERTREE_ginac(op, name) add(Op::op, GiNaC::name##_SERIAL::serial);
#define WIENERTREE_own(op, name) \
  add_new(Op::op, function_options("wt_" #name, 1).eval_func(op##_eval).derivative_func(op##_derivative));
#undef WIENERTREE_root
#define WIENERTREE_root(op, name)
#define X(op, name, algebra, machine, derivative) WIENERTREE_##algebra(op, name)
    WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
    return s;
  }();
  return registered;
}

}  // namespace

ex apply_symbolically(Op op, const std::vector<ex>& arguments) {
  const ex& x = arguments.at(0);
  if (op == Op::square_root) return GiNaC::sqrt(x);
  return arguments.size() == 1 ? call(op, x) : call(op, x, arguments.at(1));
}

Op operation(const GiNaC::function& function) {
  const auto found = serials().operation.find(function.get_serial());
  if (found == serials().operation.end())
    throw std::domain_error("no real elementary function: " + function.get_name());
  return found->second;
}

}  // namespace wienertree::text
