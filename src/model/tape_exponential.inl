// exp and tanh for machine codes with a fused multiply-add, of WIENERTREE_VECTOR, `fused` and
// WIENERTREE_INTRINSIC as in tape_machine_x86.inl. libmvec's tanh looks its polynomials up in a table, lane
// by lane, and takes three times as long.
//
// With n the integer nearest to x/ln 2 and r = x - n ln 2, |r| <= ln(2)/2 = 0.3466,
//
//   exp(x) = 2^n e^r,     e^r = 1 + r + r^2 q(r),     q(r) = sum_{k=0..11} r^k / (k+2)!
//
// whose remainder is below r^14/14! < 2^-56 |r| (W. J. Cody, W. Waite 1980, Software Manual for the
// Elementary Functions, chapter 6). For tanh, with a = |x|, n nearest to 2a/ln 2, r = a - n ln(2)/2 and
// S = 2^n,
//
//   exp(2a) = S exp(2r) = S (C + r)/(C - r),     C = r coth r = 1 + r^2/3 - r^4/45 + ..
//   tanh(a) = (exp(2a) - 1)/(exp(2a) + 1) = ((S - 1) C + (S + 1) r)/((S + 1) C + (S - 1) r)
//
// where nothing cancels: n = 0 gives r/C, and for n >= 1 the numerator is at least S/5. C(r^2) is the
// polynomial of FreeBSD's msun (e_exp.c; Sun Microsystems 2004), good to 2^-59, at 2r. Errors: exp 1, tanh
// 2.5 units in the last place.

namespace wienertree {
namespace {

typedef long long Bits __attribute__((vector_size(sizeof(WIENERTREE_VECTOR))));

WIENERTREE_VECTOR all(double x) { return WIENERTREE_INTRINSIC(set1_pd)(x); }

/// n + 1.5 2^52: the sum of an integer |n| < 2^51 and this number holds n in its lowest bits.
constexpr double integer_shift = 0x1.8p52;

/// 2^n, from n + 1.5 2^52, for -1022 <= n <= 1023.
WIENERTREE_VECTOR power_of_two(WIENERTREE_VECTOR shifted) {
  return (WIENERTREE_VECTOR)(((Bits)shifted << 52) + (Bits)all(1.0));
}

/// x - n ln 2, ln 2 = its first 32 bits, so that n times them is exact, and the rest.
WIENERTREE_VECTOR remainder(WIENERTREE_VECTOR x, WIENERTREE_VECTOR n) {
  return fused(n, all(-0x1.a39ef35793c76p-33), fused(n, all(-0x1.62e42feep-1), x));
}

/// a - n ln(2)/2
WIENERTREE_VECTOR half_remainder(WIENERTREE_VECTOR a, WIENERTREE_VECTOR n) {
  return fused(n, all(0.5 * -0x1.a39ef35793c76p-33), fused(n, all(0.5 * -0x1.62e42feep-1), a));
}

/// r + r^2 q(r) = e^r - 1
WIENERTREE_VECTOR reduced_exponential(WIENERTREE_VECTOR r) {
  const auto pair = [&](double low, double high) { return fused(all(high), r, all(low)); };
  const WIENERTREE_VECTOR r2 = r * r, r4 = r2 * r2;
  const WIENERTREE_VECTOR q0 = fused(pair(1.0 / 24, 1.0 / 120), r2, pair(1.0 / 2, 1.0 / 6));
  const WIENERTREE_VECTOR q4 = fused(pair(1.0 / 40320, 1.0 / 362880), r2, pair(1.0 / 720, 1.0 / 5040));
  const WIENERTREE_VECTOR q8 =
      fused(pair(1.0 / 479001600, 1.0 / 6227020800.0), r2, pair(1.0 / 3628800, 1.0 / 39916800));
  return fused(fused(fused(q8, r4, q4), r4, q0), r2, r);
}

/// The value nearest to x in [lower, upper]; NaN where x is NaN, for the processor gives its second operand
/// then.
WIENERTREE_VECTOR limited(double lower, double upper, WIENERTREE_VECTOR x) {
  return WIENERTREE_INTRINSIC(max_pd)(all(lower), WIENERTREE_INTRINSIC(min_pd)(all(upper), x));
}

constexpr double log2_e = 0x1.71547652b82fep0;

WIENERTREE_VECTOR vector_exp(WIENERTREE_VECTOR x) {
  x = limited(-746.0, 710.0, x);  // beyond, 0 and infinity
  // 2^n in two factors, n/2 each: n reaches 1024 above and -1076 below, where only the last product may
  // round.
  const WIENERTREE_VECTOR n = fused(x, all(log2_e), all(integer_shift)) - all(integer_shift);
  const WIENERTREE_VECTOR half = fused(n, all(0.5), all(integer_shift));
  const WIENERTREE_VECTOR rest = (n - (half - all(integer_shift))) + all(integer_shift);
  const WIENERTREE_VECTOR e = all(1.0) + reduced_exponential(remainder(x, n));
  return e * power_of_two(half) * power_of_two(rest);
}

/// r coth r, |r| <= ln(2)/4
WIENERTREE_VECTOR times_coth(WIENERTREE_VECTOR r) {
  const WIENERTREE_VECTOR z = r * r;
  WIENERTREE_VECTOR sum = all(0x1p9 * 4.13813679705723846039e-08);
  sum = fused(sum, z, all(0x1p7 * -1.65339022054652515390e-06));
  sum = fused(sum, z, all(0x1p5 * 6.61375632143793436117e-05));
  sum = fused(sum, z, all(0x1p3 * -2.77777777770155933842e-03));
  sum = fused(sum, z, all(0x1p1 * 1.66666666666666019037e-01));
  return fused(sum, z, all(1.0));
}

WIENERTREE_VECTOR vector_tanh(WIENERTREE_VECTOR x) {
  const WIENERTREE_VECTOR a =
      WIENERTREE_INTRINSIC(min_pd)(all(20.0), magnitude(x));  // NaN stays; tanh(20) is 1 to 2^-57
  const WIENERTREE_VECTOR shifted = fused(a, all(2 * log2_e), all(integer_shift));
  const WIENERTREE_VECTOR r = half_remainder(a, shifted - all(integer_shift));
  const WIENERTREE_VECTOR C = times_coth(r), S = power_of_two(shifted);
  const WIENERTREE_VECTOR minus = S - all(1.0), plus = S + all(1.0);
  const WIENERTREE_VECTOR t = fused(minus, C, plus * r) / fused(plus, C, minus * r);
  return (WIENERTREE_VECTOR)((Bits)t | ((Bits)x & (Bits)all(-0.0)));
}

}  // namespace
}  // namespace wienertree
