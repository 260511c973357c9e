#pragma once
/// The one table of the elementary functions of one argument: operations of the tape, functions of the model
/// language, of Dual and of Recorded, their derivatives. Everything else is generated from it: the codes of
/// the tape and its kernels, `apply`, the parser's and the printer's names, the symbolic derivatives.
///
///   X(operation, name, algebra, machine, derivative)
///
///   operation   the name in `Op`
///   name        what a user writes, and what is found in `scalar` for doubles (scalar_functions.hpp)
///   algebra     `ginac` where GiNaC has a function of this name; `own` where it is registered by
///               text/functions.cpp with this derivative; `root` for the square root, which is a power there
///   machine     `libmvec` where glibc's libmvec has a function of this name; `fused` where
///               tape_exponential.inl has a faster one for machines with a fused multiply-add; `scalar` where
///               it is computed lane by lane; `direct` where each Machine writes it
///   derivative  in terms of the argument x and the value y, of the functions of this table and of the
///               constants inv_sqrtpi = 1/sqrt(pi), inv_sqrt2pi = 1/sqrt(2 pi). For doubles, Duals, Recorded
///               and GiNaC alike: whole numbers are written as such.
///
/// A new function is a new last row, unless the C library lacks it: then also a function in
/// scalar_functions.hpp. The order is that of `Op`, which sorts functions inside sums and products: rows are
/// added at the end so that models keep their rounding. This header must stay free of inline functions: see
/// tape_kernel.hpp.

// clang-format off
#define WIENERTREE_ELEMENTARY_FUNCTIONS(X)                                                              \
  X(square_root, sqrt, root, direct, 0.5 / y)                                                           \
  X(exponential, exp, ginac, fused, y)                                                                  \
  X(logarithm, log, ginac, libmvec, 1.0 / x)                                                            \
  X(sine, sin, ginac, libmvec, cos(x))                                                                  \
  X(cosine, cos, ginac, libmvec, -sin(x))                                                               \
  X(tangent, tan, ginac, libmvec, 1.0 + y * y)                                                          \
  X(hyperbolic_sine, sinh, ginac, libmvec, cosh(x))                                                     \
  X(hyperbolic_cosine, cosh, ginac, libmvec, sinh(x))                                                   \
  X(hyperbolic_tangent, tanh, ginac, fused, 1.0 - y * y)                                                \
  X(arctangent, atan, ginac, libmvec, 1.0 / (1.0 + x * x))                                              \
  X(error_function, erf, own, libmvec, 2 * inv_sqrtpi * exp(-(x * x)))                                  \
  X(error_function_complement, erfc, own, libmvec, -2 * inv_sqrtpi * exp(-(x * x)))                     \
  X(arcsine, asin, ginac, libmvec, 1 / sqrt(1 - x * x))                                                 \
  X(arccosine, acos, ginac, libmvec, -1 / sqrt(1 - x * x))                                              \
  X(inverse_hyperbolic_sine, asinh, ginac, libmvec, 1 / sqrt(1 + x * x))                                \
  X(inverse_hyperbolic_cosine, acosh, ginac, libmvec, 1 / (sqrt(x - 1) * sqrt(x + 1)))                  \
  X(inverse_hyperbolic_tangent, atanh, ginac, libmvec, 1 / (1 - x * x))                                 \
  X(exponential_minus_one, expm1, own, libmvec, exp(x))                                                 \
  X(logarithm_of_one_plus, log1p, own, libmvec, 1 / (1 + x))                                            \
  X(normal_distribution, normcdf, own, scalar, inv_sqrt2pi * exp(-(x * x) / 2))                         \
  X(logarithm_of_gamma, lgamma, own, scalar, digamma(x))                                                \
  X(digamma, digamma, own, scalar, trigamma(x))                                                         \
  X(trigamma, trigamma, own, scalar, tetragamma(x))
// clang-format on
