#include "wienertree/model/scalar_functions.hpp"

#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>
#include <limits>

namespace wienertree::scalar {

namespace {

// Errors of Boost become NaN rather than exceptions, and nothing is promoted to long double.
using Quiet = boost::math::policies::policy<
    boost::math::policies::pole_error<boost::math::policies::errno_on_error>,
    boost::math::policies::domain_error<boost::math::policies::errno_on_error>,
    boost::math::policies::overflow_error<boost::math::policies::errno_on_error>,
    boost::math::policies::evaluation_error<boost::math::policies::errno_on_error>,
    boost::math::policies::promote_double<false>>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

// 0, -1, -2, ..; doubles below -2^52 are all whole.
bool is_pole(double x) { return x <= 0 && std::floor(x) == x; }

}  // namespace

double normcdf(double x) {
  // z + dz = -x/sqrt(2) to twice the precision; erfc(z + dz) = erfc(z) - 2/sqrt(pi) exp(-z^2) dz, without
  // which the relative error would be x^2/2 units in the last place.
  constexpr double high = 0x1.6a09e667f3bcdp-1, low = -0x1.bdd3413b26456p-55;  // of 1/sqrt(2)
  if (!(std::abs(x) < 40)) return x != x ? x : x > 0 ? 1.0 : 0.0;
  const double z = -x * high, dz = std::fma(-x, high, -z) - x * low;
  return 0.5 * (std::erfc(z) - 2 * inv_sqrtpi * std::exp(-z * z) * dz);
}

double lgamma(double x) {
  int sign = 0;
  return ::lgamma_r(x, &sign);
}

double digamma(double x) {
  if (x != x || is_pole(x)) return nan;
  return x == infinity ? x : boost::math::digamma(x, Quiet());
}

double trigamma(double x) {
  if (x != x || is_pole(x)) return nan;
  return x == infinity ? 0.0 : boost::math::trigamma(x, Quiet());
}

}  // namespace wienertree::scalar
