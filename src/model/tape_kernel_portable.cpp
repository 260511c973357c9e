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
  static double where(double c, double a) { return c != c ? c : c != 0 ? a : 0.0; }
  static double unless(double c, double a) { return c != c ? c : c != 0 ? 0.0 : a; }

  static double multiply_add(double a, double b, double c) { return a * b + c; }
  static double multiply_subtract(double a, double b, double c) { return a * b - c; }
  static double negative_multiply_add(double a, double b, double c) { return c - a * b; }

  static double negate(double a) { return -a; }
  static double absolute(double a) { return fabs(a); }
  static double sign(double a) { return a != a ? a : double(a > 0) - double(a < 0); }
  static double step(double a) { return a != a ? a : double(a > 0); }
  static double square_root(double a) { return sqrt(a); }

#define WIENERTREE_direct(operation)
#define WIENERTREE_scalar(operation) \
  static double operation(double a) { return scalar_##operation(a); }
#define WIENERTREE_libmvec(operation) WIENERTREE_scalar(operation)
#define WIENERTREE_fused(operation) WIENERTREE_scalar(operation)
#define X(operation, name, algebra, machine, derivative) WIENERTREE_##machine(operation)
  WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
};

}  // namespace
}  // namespace wienertree

#include "tape_kernel.inl"

namespace wienertree {
const TapeKernel portable_kernel{"portable", Machine::width, run_program};
}
