// The tape by the C library's scalar functions, for any machine.
#include <math.h>

#include "wienertree/model/tape_kernel.hpp"
#include "wienertree/model/tape_kernel_table.hpp"

namespace wienertree {
namespace {

struct Machine {
  using Vector = double;
  static constexpr size_t width = 1;
  static double load(const double* p) { return *p; }
  static void store(double* p, double x) { *p = x; }
  static double broadcast(double x) { return x; }

  static double add(double a, double b) { return a + b; }
  static double subtract(double a, double b) { return a - b; }
  static double multiply(double a, double b) { return a * b; }
  static double divide(double a, double b) { return a / b; }
  static double power(double a, double b) { return pow(a, b); }
  static double minimum(double a, double b) { return a < b || a != a ? a : b; }
  static double maximum(double a, double b) { return a > b || a != a ? a : b; }

  static double multiply_add(double a, double b, double c) { return a * b + c; }
  static double multiply_subtract(double a, double b, double c) { return a * b - c; }
  static double negative_multiply_add(double a, double b, double c) { return c - a * b; }

  static double negate(double a) { return -a; }
  static double absolute(double a) { return fabs(a); }
  static double sign(double a) { return a != a ? a : double(a > 0) - double(a < 0); }
  static double step(double a) { return a != a ? a : double(a > 0); }
  static double square_root(double a) { return sqrt(a); }
  static double exponential(double a) { return exp(a); }
  static double logarithm(double a) { return log(a); }
  static double sine(double a) { return sin(a); }
  static double cosine(double a) { return cos(a); }
  static double tangent(double a) { return tan(a); }
  static double hyperbolic_sine(double a) { return sinh(a); }
  static double hyperbolic_cosine(double a) { return cosh(a); }
  static double hyperbolic_tangent(double a) { return tanh(a); }
  static double arctangent(double a) { return atan(a); }
  static double error_function(double a) { return erf(a); }
  static double error_function_complement(double a) { return erfc(a); }
};

}  // namespace
}  // namespace wienertree

#include "tape_kernel.inl"

namespace wienertree {
const TapeKernel portable_kernel{"portable", Machine::width, run_program};
}
