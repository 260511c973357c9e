// What the x86-64 machine codes have in common: `Machine` for tape_kernel.inl. The including file defines
// WIENERTREE_VECTOR (__m256d, say), WIENERTREE_INTRINSIC(name) (_mm256_name), WIENERTREE_LIBMVEC_1(name) and
// WIENERTREE_LIBMVEC_2(name) (the functions of one and two arguments of glibc's libmvec, by their names in
// the x86-64 vector function ABI: _ZGV, instruction set, N for unmasked, width, a v for each argument),
// WIENERTREE_EXP(x) and WIENERTREE_TANH(x), and the functions
//
//   fused(a, b, c)      a b + c, in one rounding where the machine can
//   nan_of(a, result)   a where a is NaN, else result
//   positive(a)         1 where a > 0, else 0
//   magnitude(a)        |a|

extern "C" {
#define X(name) __attribute__((const)) WIENERTREE_VECTOR WIENERTREE_LIBMVEC_1(name)(WIENERTREE_VECTOR);
X(exp)
X(log)
X(sin) X(cos) X(tan) X(sinh) X(cosh) X(tanh) X(atan) X(erf) X(erfc)
#undef X
    __attribute__((const)) WIENERTREE_VECTOR WIENERTREE_LIBMVEC_2(pow)(WIENERTREE_VECTOR, WIENERTREE_VECTOR);
}

namespace wienertree {
namespace {

struct Machine {
  using Vector = WIENERTREE_VECTOR;
  static constexpr size_t width = sizeof(Vector) / sizeof(double);
  static Vector load(const double* p) { return WIENERTREE_INTRINSIC(loadu_pd)(p); }
  static void store(double* p, Vector x) { WIENERTREE_INTRINSIC(storeu_pd)(p, x); }
  static Vector broadcast(double x) { return WIENERTREE_INTRINSIC(set1_pd)(x); }

  static Vector add(Vector a, Vector b) { return a + b; }
  static Vector subtract(Vector a, Vector b) { return a - b; }
  static Vector multiply(Vector a, Vector b) { return a * b; }
  static Vector divide(Vector a, Vector b) { return a / b; }
  static Vector power(Vector a, Vector b) { return WIENERTREE_LIBMVEC_2(pow)(a, b); }
  // The processor's minimum and maximum give b where either is NaN.
  static Vector minimum(Vector a, Vector b) { return nan_of(a, WIENERTREE_INTRINSIC(min_pd)(a, b)); }
  static Vector maximum(Vector a, Vector b) { return nan_of(a, WIENERTREE_INTRINSIC(max_pd)(a, b)); }

  static Vector multiply_add(Vector a, Vector b, Vector c) { return fused(a, b, c); }
  static Vector multiply_subtract(Vector a, Vector b, Vector c) { return fused(a, b, -c); }
  static Vector negative_multiply_add(Vector a, Vector b, Vector c) { return fused(-a, b, c); }

  static Vector negate(Vector a) { return -a; }
  static Vector absolute(Vector a) { return magnitude(a); }
  static Vector sign(Vector a) { return nan_of(a, positive(a) - positive(-a)); }
  static Vector step(Vector a) { return nan_of(a, positive(a)); }
  static Vector square_root(Vector a) { return WIENERTREE_INTRINSIC(sqrt_pd)(a); }
  static Vector exponential(Vector a) { return WIENERTREE_EXP(a); }
  static Vector logarithm(Vector a) { return WIENERTREE_LIBMVEC_1(log)(a); }
  static Vector sine(Vector a) { return WIENERTREE_LIBMVEC_1(sin)(a); }
  static Vector cosine(Vector a) { return WIENERTREE_LIBMVEC_1(cos)(a); }
  static Vector tangent(Vector a) { return WIENERTREE_LIBMVEC_1(tan)(a); }
  static Vector hyperbolic_sine(Vector a) { return WIENERTREE_LIBMVEC_1(sinh)(a); }
  static Vector hyperbolic_cosine(Vector a) { return WIENERTREE_LIBMVEC_1(cosh)(a); }
  static Vector hyperbolic_tangent(Vector a) { return WIENERTREE_TANH(a); }
  static Vector arctangent(Vector a) { return WIENERTREE_LIBMVEC_1(atan)(a); }
  static Vector error_function(Vector a) { return WIENERTREE_LIBMVEC_1(erf)(a); }
  static Vector error_function_complement(Vector a) { return WIENERTREE_LIBMVEC_1(erfc)(a); }
};

}  // namespace
}  // namespace wienertree
