#pragma once
/// Elementary functions on the ranges that drawing and weighing need, as straight-line IEEE arithmetic: a
/// loop over them vectorises, and vector lanes, remainder lanes and all processors give the same bits.
/// Polynomials of FreeBSD's msun (e_log.c, k_sin.c, k_cos.c, e_exp.c; Sun Microsystems 1993). Errors below 1
/// ulp, 2 for the exponential.
#include <bit>
#include <cstdint>

namespace wienertree::elementary {

inline constexpr double shift_to_integer = 0x1.8p52;  ///< x + this - this rounds |x| < 2^51 to nearest

/// log x for x in [2^-60, 2^3].
///
/// x = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt 2); s = f / (2 + f);
/// log(1 + f) = f - f^2/2 + s (f^2/2 + R(s^2)), R(z) = 2/3 z + 2/5 z^2 + ...
inline double log_near_unit(double x) {
  constexpr std::uint64_t root_half = 0x3fe6a09e667f3bcd, one = 0x3ff0000000000000;
  constexpr std::uint64_t bias = 64;
  const std::uint64_t distance = std::bit_cast<std::uint64_t>(x) - root_half + (bias << 52);
  const std::uint64_t k_biased = distance >> 52;
  const double k = std::bit_cast<double>(k_biased | 0x4330000000000000) - (0x1.0p52 + double{bias});
  const std::uint64_t mantissa = (distance & 0x000fffffffffffff) + root_half;
  static_assert(one > root_half);
  const double f = std::bit_cast<double>(mantissa) - 1.0;
  const double s = f / (2.0 + f), z = s * s, w = z * z;
  const double even =
      w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
  const double odd =
      z * (6.666666666666735130e-01 +
           w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
  const double half_square = 0.5 * f * f;
  return k * 6.93147180369123816490e-01 -
         ((half_square - (s * (half_square + (even + odd)) + k * 1.90821492927058770002e-10)) - f);
}

struct SineCosine {
  double sine, cosine;
};

/// sin and cos of 2 pi v for v in [0, 1]. 4 v - rint(4 v) is exact, so the angle is rounded once.
inline SineCosine sine_cosine_of_turn(double v) {
  const double quarters = 4.0 * v;
  const double shifted = quarters + shift_to_integer;
  const std::uint64_t quadrant = std::bit_cast<std::uint64_t>(shifted);
  const double y = (quarters - (shifted - shift_to_integer)) * 1.57079632679489661923;
  const double z = y * y;
  const double sine =
      y + y * z *
              (-1.66666666666666324348e-01 +
               z * (8.33333333332248946124e-03 +
                    z * (-1.98412698298579493134e-04 +
                         z * (2.75573137070700676789e-06 +
                              z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  const double cosine =
      1.0 -
      (0.5 * z - z * z *
                     (4.16666666666666019037e-02 +
                      z * (-1.38888888888741095749e-03 +
                           z * (2.48015872894767294178e-05 +
                                z * (-2.75573143513906633035e-07 +
                                     z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))));
  const std::uint64_t swap = 0 - (quadrant & 1);
  const std::uint64_t s = std::bit_cast<std::uint64_t>(sine), c = std::bit_cast<std::uint64_t>(cosine);
  const std::uint64_t sine_sign = (quadrant & 2) << 62, cosine_sign = ((quadrant + 1) & 2) << 62;
  return {std::bit_cast<double>(((s & ~swap) | (c & swap)) ^ sine_sign),
          std::bit_cast<double>(((c & ~swap) | (s & swap)) ^ cosine_sign)};
}

/// exp x for x <= 0, and 0 for x < -700.
///
/// x = n log 2 + r, |r| <= log(2)/2; exp r = 1 + r + r c / (2 - c), c = r - r^2 P(r^2).
inline double exp_nonpositive(double x) {
  const double clamped = x < -700.0 ? -700.0 : x;
  const double shifted = clamped * 1.44269504088896338700 + shift_to_integer;
  const double n = shifted - shift_to_integer;
  const double high = clamped - n * 6.93147180369123816490e-01, low = n * 1.90821492927058770002e-10;
  const double r = high - low, z = r * r;
  const double c = r - z * (1.66666666666666019037e-01 +
                            z * (-2.77777777770155933842e-03 +
                                 z * (6.61375632143793436117e-05 +
                                      z * (-1.65339022054652515390e-06 + z * 4.13813679705723846039e-08))));
  const double y = 1.0 + ((r * c / (2.0 - c) - low) + high);
  // y in [0.7, 1.5], n >= -1010: the product is a normal number.
  const double scaled =
      std::bit_cast<double>(std::bit_cast<std::uint64_t>(y) + (std::bit_cast<std::uint64_t>(shifted) << 52));
  return x < -700.0 ? 0.0 : scaled;
}

}  // namespace wienertree::elementary
