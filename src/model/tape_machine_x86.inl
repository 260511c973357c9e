// What the x86-64 machine codes have in common: `Machine` for tape_kernel.inl. The including file defines
// WIENERTREE_VECTOR (__m256d, say), WIENERTREE_INTRINSIC(name) (_mm256_name), WIENERTREE_LIBMVEC_1(name) and
// WIENERTREE_LIBMVEC_2(name) (the functions of one and two arguments of glibc's libmvec, by their names in
// the x86-64 vector function ABI: _ZGV, instruction set, N for unmasked, width, a v for each argument),
// WIENERTREE_FUSED(name) (vector_name of tape_exponential.inl, or WIENERTREE_LIBMVEC_1(name)), and the functions
//
//   fused(a, b, c)      a b + c, in one rounding where the machine can
//   nan_of(a, result)   a where a is NaN, else result
//   positive(a)         1 where a > 0, else 0
//   magnitude(a)        |a|
//   where_not_zero(c, a), where_zero(c, a)   a where c is not 0, or is; else 0

extern "C" {
#define WIENERTREE_direct(name)
#define WIENERTREE_scalar(name)
#define WIENERTREE_libmvec(name) \
  __attribute__((const)) WIENERTREE_VECTOR WIENERTREE_LIBMVEC_1(name)(WIENERTREE_VECTOR);
#define WIENERTREE_fused(name) WIENERTREE_libmvec(name)
#define X(operation, name, algebra, machine, derivative) WIENERTREE_##machine(name)
WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
#undef WIENERTREE_direct
#undef WIENERTREE_scalar
#undef WIENERTREE_libmvec
#undef WIENERTREE_fused
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
  static Vector where(Vector c, Vector a) { return nan_of(c, where_not_zero(c, a)); }
  static Vector unless(Vector c, Vector a) { return nan_of(c, where_zero(c, a)); }

  static Vector multiply_add(Vector a, Vector b, Vector c) { return fused(a, b, c); }
  static Vector multiply_subtract(Vector a, Vector b, Vector c) { return fused(a, b, -c); }
  static Vector negative_multiply_add(Vector a, Vector b, Vector c) { return fused(-a, b, c); }

  static Vector negate(Vector a) { return -a; }
  static Vector absolute(Vector a) { return magnitude(a); }
  static Vector sign(Vector a) { return nan_of(a, positive(a) - positive(-a)); }
  static Vector step(Vector a) { return nan_of(a, positive(a)); }
  static Vector square_root(Vector a) { return WIENERTREE_INTRINSIC(sqrt_pd)(a); }

#define WIENERTREE_direct(operation, name)
#define WIENERTREE_scalar(operation, name) \
  static Vector operation(Vector a) { return lane_by_lane(a, scalar_##operation); }
#define WIENERTREE_libmvec(operation, name) \
  static Vector operation(Vector a) { return WIENERTREE_LIBMVEC_1(name)(a); }
#define WIENERTREE_fused(operation, name) \
  static Vector operation(Vector a) { return WIENERTREE_FUSED(name)(a); }
#define X(operation, name, algebra, machine, derivative) WIENERTREE_##machine(operation, name)
  WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X

 private:
  static Vector lane_by_lane(Vector a, double (*f)(double)) {
    double lanes[width];
    store(lanes, a);
    for (size_t i = 0; i < width; ++i) lanes[i] = f(lanes[i]);
    return load(lanes);
  }
};

}  // namespace
}  // namespace wienertree
