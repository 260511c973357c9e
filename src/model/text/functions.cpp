// The functions of the language in GiNaC. abs, min, max and erf, with the derivatives
//
//   abs' = sign,   erf'(x) = 2/sqrt(pi) exp(-x^2),
//   d min(a,b) = (1 - step(a-b)) da + step(a-b) db,
//   d max(a,b) = step(a-b) da + (1 - step(a-b)) db,     step(x) = 1 for x > 0, else 0,
//
// are our own: GiNaC's abs is that of complex numbers, and it has no min, max or erf.
#include <array>
#include <stdexcept>

#include "wienertree/model/text/symbolic.hpp"

namespace wienertree::text {

namespace {

using GiNaC::ex;
using GiNaC::numeric;

struct Serials {
  unsigned absolute, sign, step, minimum, maximum, error_function;
};
const Serials& serials();

ex call(unsigned serial, const ex& a) { return GiNaC::function(serial, a); }
ex call(unsigned serial, const ex& a, const ex& b) { return GiNaC::function(serial, a, b); }

bool is_number(const ex& e) { return GiNaC::is_exactly_a<numeric>(e); }
const numeric& to_number(const ex& e) { return GiNaC::ex_to<numeric>(e); }

ex sign_eval(const ex& x) {
  if (is_number(x)) return to_number(x).csgn();
  return GiNaC::function(serials().sign, x).hold();
}
ex step_eval(const ex& x) {
  if (is_number(x)) return to_number(x).csgn() > 0 ? 1 : 0;
  return GiNaC::function(serials().step, x).hold();
}
ex flat_derivative(const ex&, unsigned) { return 0; }

ex absolute_eval(const ex& x) {
  if (is_number(x)) return to_number(x).csgn() * x;
  return GiNaC::function(serials().absolute, x).hold();
}
ex absolute_derivative(const ex& x, unsigned) { return call(serials().sign, x); }

ex minimum_eval(const ex& a, const ex& b) {
  if (is_number(a) && is_number(b)) return to_number(a) < to_number(b) ? a : b;
  return GiNaC::function(serials().minimum, a, b).hold();
}
ex minimum_derivative(const ex& a, const ex& b, unsigned by) {
  const ex second_is_less = call(serials().step, a - b);
  return by == 0 ? 1 - second_is_less : second_is_less;
}

ex maximum_eval(const ex& a, const ex& b) {
  if (is_number(a) && is_number(b)) return to_number(a) > to_number(b) ? a : b;
  return GiNaC::function(serials().maximum, a, b).hold();
}
ex maximum_derivative(const ex& a, const ex& b, unsigned by) {
  const ex first_is_greater = call(serials().step, a - b);
  return by == 0 ? first_is_greater : 1 - first_is_greater;
}

ex error_function_eval(const ex& x) {
  if (x.is_zero()) return 0;
  return GiNaC::function(serials().error_function, x).hold();
}
ex error_function_derivative(const ex& x, unsigned) {
  return 2 * GiNaC::power(GiNaC::Pi, numeric(-1, 2)) * GiNaC::exp(-x * x);
}

const Serials& serials() {
  using GiNaC::function;
  using GiNaC::function_options;
  static const Serials registered = [] {
    Serials s{};
    s.absolute = function::register_new(
        function_options("wt_abs", 1).eval_func(absolute_eval).derivative_func(absolute_derivative));
    s.sign = function::register_new(
        function_options("wt_sign", 1).eval_func(sign_eval).derivative_func(flat_derivative));
    s.step = function::register_new(
        function_options("wt_step", 1).eval_func(step_eval).derivative_func(flat_derivative));
    s.minimum = function::register_new(
        function_options("wt_min", 2).eval_func(minimum_eval).derivative_func(minimum_derivative));
    s.maximum = function::register_new(
        function_options("wt_max", 2).eval_func(maximum_eval).derivative_func(maximum_derivative));
    s.error_function = function::register_new(function_options("wt_erf", 1)
                                                  .eval_func(error_function_eval)
                                                  .derivative_func(error_function_derivative));
    return s;
  }();
  return registered;
}

}  // namespace

ex apply_symbolically(Op op, const std::vector<ex>& arguments) {
  const ex& x = arguments.at(0);
  switch (op) {
    case Op::exponential:
      return GiNaC::exp(x);
    case Op::logarithm:
      return GiNaC::log(x);
    case Op::square_root:
      return GiNaC::sqrt(x);
    case Op::sine:
      return GiNaC::sin(x);
    case Op::cosine:
      return GiNaC::cos(x);
    case Op::tangent:
      return GiNaC::tan(x);
    case Op::hyperbolic_sine:
      return GiNaC::sinh(x);
    case Op::hyperbolic_cosine:
      return GiNaC::cosh(x);
    case Op::hyperbolic_tangent:
      return GiNaC::tanh(x);
    case Op::arctangent:
      return GiNaC::atan(x);
    case Op::error_function:
      return call(serials().error_function, x);
    case Op::absolute:
      return call(serials().absolute, x);
    case Op::minimum:
      return call(serials().minimum, x, arguments.at(1));
    case Op::maximum:
      return call(serials().maximum, x, arguments.at(1));
    default:
      throw std::logic_error("not a function of the language");
  }
}

Op operation(const GiNaC::function& function) {
  const std::array<std::pair<unsigned, Op>, 15> known{{{GiNaC::exp_SERIAL::serial, Op::exponential},
                                                       {GiNaC::log_SERIAL::serial, Op::logarithm},
                                                       {GiNaC::sin_SERIAL::serial, Op::sine},
                                                       {GiNaC::cos_SERIAL::serial, Op::cosine},
                                                       {GiNaC::tan_SERIAL::serial, Op::tangent},
                                                       {GiNaC::sinh_SERIAL::serial, Op::hyperbolic_sine},
                                                       {GiNaC::cosh_SERIAL::serial, Op::hyperbolic_cosine},
                                                       {GiNaC::tanh_SERIAL::serial, Op::hyperbolic_tangent},
                                                       {GiNaC::atan_SERIAL::serial, Op::arctangent},
                                                       {serials().error_function, Op::error_function},
                                                       {serials().absolute, Op::absolute},
                                                       {serials().sign, Op::sign},
                                                       {serials().step, Op::step},
                                                       {serials().minimum, Op::minimum},
                                                       {serials().maximum, Op::maximum}}};
  for (const auto& [serial, op] : known)
    if (function.get_serial() == serial) return op;
  throw std::domain_error("no real elementary function: " + function.get_name());
}

}  // namespace wienertree::text
