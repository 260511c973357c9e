#pragma once
/// The functions of the model language on doubles, by the names a user writes. Those of the C library, and
/// what it lacks.
#include <cmath>
#include <numbers>

#include "wienertree/model/elementary_functions.hpp"

/// NaN of NaN throughout.
namespace wienertree::scalar {

using std::abs, std::exp, std::log, std::sqrt, std::pow;
using std::acosh, std::asinh, std::atanh, std::cosh, std::sinh, std::tanh;
using std::asin, std::acos, std::atan, std::cos, std::sin, std::tan;
using std::erf, std::erfc, std::expm1, std::log1p;

inline constexpr double inv_sqrtpi = std::numbers::inv_sqrtpi;
inline constexpr double inv_sqrt2pi = 0.3989422804014326779399460599344;  ///< 1/sqrt(2 pi)

/// The standard normal distribution function, 1/2 erfc(-x/sqrt(2)), accurate in the lower tail too.
double normcdf(double x);
/// log |Gamma(x)|; infinity at 0, -1, -2, .. (std::lgamma writes a global variable)
double lgamma(double x);
/// (d/dx) log Gamma(x), NaN at 0, -1, -2, ..; close to these less accurate
double digamma(double x);
/// (d/dx)^2 log Gamma(x), NaN at 0, -1, -2, ..; close to these less accurate
double trigamma(double x);
/// (d/dx)^3 log Gamma(x) is not part of the language.
double tetragamma(double x) = delete;

/// -1, 0, 1
inline double sign(double x) { return x != x ? x : double(x > 0) - double(x < 0); }
/// 1 for x > 0, else 0
inline double step(double x) { return x != x ? x : double(x > 0); }
inline double min(double a, double b) { return a < b || a != a ? a : b; }
inline double max(double a, double b) { return a > b || a != a ? a : b; }
/// a where the condition c holds (is not 0), else 0, whatever a is there
inline double where(double c, double a) { return c != c ? c : c != 0 ? a : 0.0; }
/// a where the condition c does not hold, else 0
inline double unless(double c, double a) { return c != c ? c : c != 0 ? 0.0 : a; }
/// weight * slope, and 0 where the slope is 0 whatever the weight.
inline double weighted(double weight, double slope) { return slope == 0.0 ? 0.0 : weight * slope; }

}  // namespace wienertree::scalar
