// exp and tanh for machine codes with a fused multiply-add, of WIENERTREE_VECTOR, `fused` and
// WIENERTREE_INTRINSIC as in tape_machine_x86.inl. libmvec's tanh looks its polynomials up in a table, lane
// by lane, and takes three times as long.
//
// With n the integer nearest to x/ln 2 and r = x - n ln 2, |r| <= ln(2)/2 = 0.3466,
//
//   exp(x) = 2^n e^r,     e^r = 1 + r + r^2 q(r),     q(r) = sum_{k=0..11} r^k / (k+2)!
//
// whose remainder is below r^14/14! < 2^-56 |r|. For tanh, with y = 2|x|:
//
//   tanh(x) = sign(x) m/(m + 2),     m = exp(y) - 1 = 2^n (r + r^2 q(r)) + (2^n - 1)
//
// where nothing cancels: n = 0 gives m = r + r^2 q(r), and for n >= 1 m >= 0.41. (W. J. Cody, W. Waite 1980,
// Software Manual for the Elementary Functions, chapters 6 and 13.) Errors: exp 1, tanh 2.5 units in the last
// place.

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

WIENERTREE_VECTOR vector_tanh(WIENERTREE_VECTOR x) {
  const WIENERTREE_VECTOR a = magnitude(x);
  const WIENERTREE_VECTOR y = limited(0.0, 40.0, a + a);  // tanh(20) is 1 to 2^-57
  const WIENERTREE_VECTOR shifted = fused(y, all(log2_e), all(integer_shift));
  const WIENERTREE_VECTOR p = reduced_exponential(remainder(y, shifted - all(integer_shift)));
  const WIENERTREE_VECTOR scale = power_of_two(shifted);
  const WIENERTREE_VECTOR m = fused(scale, p, scale - all(1.0));
  return (WIENERTREE_VECTOR)((Bits)(m / (m + all(2.0))) | ((Bits)x & (Bits)all(-0.0)));
}

}  // namespace
}  // namespace wienertree
