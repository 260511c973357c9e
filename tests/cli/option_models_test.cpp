// The runs that the documentation shows of the bundled models of local and stochastic volatility, against closed forms.
#include <catch2/catch.hpp>

#include <algorithm>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "program.hpp"

using cli::Outcome;
using cli::Workplace;

namespace {

nlohmann::json rows_of(const Workplace& place, const std::string& arguments) {
  const Outcome outcome = place.run("weak " + arguments + " --quiet --format json");
  INFO(arguments << "\n" << outcome.err);
  REQUIRE(outcome.code == 0);
  return nlohmann::json::parse(outcome.out)["rows"];
}

// Schroder (1989), J. Finance 44: the undiscounted price, absorbed at 0, of dS = r S dt + sigma S^beta dW, beta < 1.
double cev_call(double S, double K, double r, double sigma, double beta, double T) {
  using Law = boost::math::non_central_chi_squared;
  const double a = 2 * (1 - beta), k = 2 * r / (sigma * sigma * a * std::expm1(r * a * T));
  const double x = k * std::pow(S, a) * std::exp(r * a * T), y = k * std::pow(K, a);
  return S * boost::math::cdf(complement(Law(2 + 2 / a, 2 * x), 2 * y)) -
         K * std::exp(-r * T) * boost::math::cdf(Law(2 / a, 2 * y), 2 * x);
}

double integral(const std::function<double(double)>& f, double to) {
  return boost::math::quadrature::gauss_kronrod<double, 61>::integrate(f, 0.0, to, 10, 1e-11);
}

// Antonov, Konikov, Spector (2015), The free boundary SABR: natural extension to negative rates, for beta = 0: with
// V = alpha/nu, k = (K - F)/V + rho, cosh s0 = (sqrt(k^2 + 1 - rho^2) - rho k)/(1 - rho^2),
//   E (F_T - K)^+ - (F - K)^+ = V/pi int_{s0}^inf G(nu^2 T, s) sqrt(sinh^2 s - (k - rho cosh s)^2) / sinh s ds,
//   G(t, s) = 2 sqrt(2) e^{-t/8} / (t sqrt(2 pi t)) int_s^inf u e^{-u^2/(2t)} sqrt(cosh u - cosh s) du.
// Integrals over v, where u = s + v^2, have smooth integrands.
double normal_sabr_call(double F, double K, double alpha, double nu, double rho, double T) {
  const double t = nu * nu * T, reach = std::sqrt(12 * std::sqrt(t));
  const auto G = [&](double s) {
    const auto inner = [&](double v) {
      const double u = s + v * v;
      return 2 * v * u * std::exp(-u * u / (2 * t)) * std::sqrt(std::max(0.0, std::cosh(u) - std::cosh(s)));
    };
    return 2 * std::sqrt(2.0) * std::exp(-t / 8) / (t * std::sqrt(2 * std::numbers::pi * t)) *
           integral(inner, reach);
  };
  const double V = alpha / nu, k = (K - F) / V + rho, rest = 1 - rho * rho;
  const double s0 = std::acosh((std::sqrt(k * k + rest) - rho * k) / rest);
  const auto outer = [&](double v) {
    const double s = s0 + v * v, under = std::pow(std::sinh(s), 2) - std::pow(k - rho * std::cosh(s), 2);
    return s > 0 ? 2 * v * G(s) * std::sqrt(std::max(0.0, under)) / std::sinh(s) : 0.0;
  };
  return std::max(F - K, 0.0) + V / std::numbers::pi * integral(outer, reach);
}

}  // namespace

TEST_CASE("weak cev: the documented run, against the noncentral chi-square law") {
  const Workplace place;
  const auto row = rows_of(place, "cev --horizon 1 --payoff exp(-r)*max(s-100,0) --tolerance 1e-5")[0];
  const double exact = cev_call(100, 100, 0.05, 0.2 * std::pow(100, 0.25), 0.75, 1);
  CHECK(exact == Approx(10.451407022818).epsilon(1e-12));
  const double error = std::abs(row["value"].get<double>() - exact);
  CHECK(error < 1e-5);
  CHECK(error <= row["error"].get<double>());
}

TEST_CASE("weak sabr: the documented run, against finite differences and, for beta = 0, the closed form") {
  const Workplace place;
  const std::string run = "sabr --horizon 1 --steps 32 --richardson";
  // bench/sabr-reference, three grids extrapolated twice: known to about 1e-6.
  const auto rows = rows_of(place, run + " --payoff max(f-80,0) --payoff max(f-100,0) --payoff max(f-120,0)");
  const std::vector<double> by_differences{21.7318302, 8.0574702, 1.8795517};
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(rows[i]["extrapolated"].get<double>() == Approx(by_differences[i]).margin(3e-5));
  const auto normal =
      rows_of(place, run + " --set beta=0 --payoff max(f-98,0) --payoff max(f-100,0) --payoff max(f-101,0)");
  const std::vector<double> strikes{98, 100, 101};
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(normal[i]["extrapolated"].get<double>() ==
          Approx(normal_sabr_call(100, strikes[i], 0.8, 0.4, -0.3, 1)).margin(1e-5));
}
