#include "option_problems.hpp"

#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <complex>
#include <numbers>

namespace wienertree::bench {
namespace {

constexpr const char* heston = R"TOML(
name = "heston"
convention = "ito"
[parameters]
r = 0.02
kappa = 1.5
theta = 0.05
xi = 0.4
rho = -0.5
[state]
s = { initial = 100.0 }
v = { initial = 0.04, lower = 0.0, boundary = "clamp" }
[drift]
s = "r*s"
v = "kappa*(theta - v)"
[diffusion]
s = ["sqrt(v)*s", "0"]
v = ["rho*xi*sqrt(v)", "xi*sqrt((1-rho^2)*v)"]
)TOML";

constexpr const char* ninomiya_victoir = R"TOML(
name = "heston-asian"
convention = "ito"
[state]
s = { initial = 1.0 }
v = { initial = 0.09, lower = 0.0, boundary = "clamp" }
[drift]
s = "0.05*s"
v = "2*(0.09 - v)"
[diffusion]
s = ["sqrt(v)*s", "0"]
v = ["0", "0.1*sqrt(v)"]
)TOML";

constexpr const char* three_assets = R"TOML(
name = "basket"
convention = "ito"
[state]
a = { initial = 100.0 }
b = { initial = 100.0 }
c = { initial = 100.0 }
[drift]
a = "0.02*a"
b = "0.02*b"
c = "0.02*c"
[diffusion]
a = ["0.2*a", 0, 0]
b = [0, "0.3*b", 0]
c = [0, 0, "0.4*c"]
[noise]
correlation = [[1, 0.5, 0.3], [0.5, 1, 0.4], [0.3, 0.4, 1]]
)TOML";

// E exp(i u log S_T).
std::complex<double> characteristic(const HestonCall& h, double u) {
  using namespace std::complex_literals;
  const std::complex<double> iu = 1i * u, b = h.kappa - h.rho * h.xi * iu;
  const std::complex<double> d = std::sqrt(b * b + h.xi * h.xi * (iu + u * u)), g = (b - d) / (b + d);
  const std::complex<double> e = std::exp(-d * h.horizon);
  const std::complex<double> A =
      h.kappa * h.theta / (h.xi * h.xi) * ((b - d) * h.horizon - 2.0 * std::log((1.0 - g * e) / (1.0 - g)));
  const std::complex<double> B = (b - d) / (h.xi * h.xi) * (1.0 - e) / (1.0 - g * e);
  return std::exp(iu * (std::log(h.s0) + h.r * h.horizon) + A + B * h.v0);
}

double normal_distribution(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

}  // namespace

double heston_digital(const HestonCall& call) {
  using namespace std::complex_literals;
  constexpr double step = 0.05;
  double sum = 0;
  for (double u = step / 2; u < 400; u += step)
    sum += (std::exp(-1i * u * std::log(call.strike)) * characteristic(call, u) / (1i * u)).real();
  return 0.5 + step * sum / std::numbers::pi;
}

double basket_call() {
  // The rows of the Cholesky factor of the correlation.
  const double l21 = 0.5, l22 = std::sqrt(0.75), l31 = 0.3, l32 = (0.4 - 0.15) / l22,
               l33 = std::sqrt(1 - l31 * l31 - l32 * l32);
  const double growth = 100 * std::exp(0.02);
  const auto density = [](double x) { return std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi); };
  const auto lognormal = [growth](double sigma, double z) {
    return growth * std::exp(sigma * z - sigma * sigma / 2);
  };
  // E (A + B exp(s z - s^2/2) - 300)^+ of a normal z.
  const auto last = [](double A, double B, double s) {
    const double K = 300 - A;
    if (!(K > 0)) return B - K;
    const double d = std::log(B / K) / s + s / 2;
    return B * normal_distribution(d) - K * normal_distribution(d - s);
  };
  using Rule = boost::math::quadrature::gauss<double, 240>;
  const auto outer = [&](double x) {
    const auto inner = [&](double y) {
      const double A = lognormal(0.2, x) + lognormal(0.3, l21 * x + l22 * y);
      // The part of the third price that is known, and what its last normal variable does.
      const double s = 0.4 * l33, B = growth * std::exp(0.4 * (l31 * x + l32 * y) - 0.08 + s * s / 2);
      return density(y) * last(A, B, s);
    };
    return density(x) * Rule::integrate(inner, -9.0, 9.0);
  };
  return Rule::integrate(outer, -9.0, 9.0) / 3;
}

std::vector<OptionProblem> option_problems() {
  const HestonCall call;
  return {
      {"call", TextModel::parse(heston, "heston"), "max(s - 105, 0)", "s - 105", call.horizon,
       HestonCall::exact},
      {"digital", TextModel::parse(heston, "heston"), "s > 105", "s - 105", call.horizon,
       heston_digital(call)},
      {"Asian", TextModel::parse(ninomiya_victoir, "heston").with_integrals({{"average_s", "s", "average"}}),
       "max(average_s - 1.05, 0)", "average_s - 1.05", 1, 0.06047362},
      {"basket", TextModel::parse(three_assets, "basket"), "max((a + b + c)/3 - 100, 0)",
       "(a + b + c)/3 - 100", 1, basket_call()}};
}

}  // namespace wienertree::bench
