/// Jacobi's diffusion: recognised in a model, and moved by the moments of its transition.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "wienertree/model/text_model.hpp"
#include "wienertree/tree/jacobi_transition.hpp"

using namespace wienertree;

namespace {

std::optional<JacobiProcess> found(const std::string& drift, const std::string& diffusion,
                                   const std::string& bounds = "lower = 0, upper = 1") {
  return jacobi_process(TextModel::parse("convention = \"ito\"\n[state]\nx = { initial = 0.3, " + bounds +
                                             ", boundary = \"clamp\" }\n[drift]\nx = \"" + drift +
                                             "\"\n[diffusion]\nx = " + diffusion + "\n",
                                         "model.toml")
                            .model());
}

// E x_s^k
double moment(const JacobiTransition& rule, double x, int degree, double s, int k) {
  double sum = 0;
  const auto children = rule.children(x, degree, s);
  for (std::size_t i = 0; i < rule.branches(degree); ++i)
    sum += children[i].weight * std::pow(children[i].x, k);
  return sum;
}

}  // namespace

TEST_CASE("Jacobi's diffusion is recognised by its coefficients") {
  const auto usual = found("0.5*(0.4 - x)", "[\"sqrt(x*(1 - x))\"]");
  REQUIRE(usual);
  CHECK(usual->a == Approx(0.2).epsilon(1e-13));
  CHECK(usual->b == Approx(-0.5).epsilon(1e-13));
  CHECK(usual->c == Approx(1).epsilon(1e-13));
  // In other words, with other bounds, by two Brownian motions, and without drift.
  CHECK(found("1 - x", "[\"0.3*sqrt(x)*sqrt(1 - x)\"]")->c == Approx(0.09).epsilon(1e-13));
  CHECK(found("-x", "[\"sqrt(1 - x^2)\"]", "lower = -1, upper = 1")->c == Approx(1).epsilon(1e-13));
  CHECK(found("0", "[\"0.6*sqrt(x - x^2)\", \"0.8*sqrt(x - x^2)\"]")->c == Approx(1).epsilon(1e-13));
  // A drift that is not affine or leads out, other noise, other bounds, one bound.
  CHECK_FALSE(found("x*(1 - x)", "[\"sqrt(x*(1 - x))\"]"));
  CHECK_FALSE(found("-0.1 - x", "[\"sqrt(x*(1 - x))\"]"));
  CHECK_FALSE(found("0.4 - x", "[\"x*(1 - x)\"]"));
  CHECK_FALSE(found("0.4 - x", "[\"sqrt(x)\"]"));
  CHECK_FALSE(found("0.4 - x", "[\"sqrt(x*(1 - x))\"]", "lower = 0, upper = 0.9"));
  CHECK_FALSE(found("0.4 - x", "[\"sqrt(x*(1 - x))\"]", "lower = 0"));
}

TEST_CASE("the rule of Jacobi's diffusion has its moments, for every start and all parameters") {
  for (const double c : {0.04, 1.0, 9.0})
    for (const double a : {0.0, 1e-3, 0.2})
      for (const double s : {1e-3, 0.1, 2.0})
        for (const double x : {0.0, 1e-9, 0.02, 0.3, 1.0})
          for (const int degree : {3, 5, 7}) {
            const double b = -2.5 * a;
            INFO("a " << a << ", c " << c << ", s " << s << ", x " << x << ", degree " << degree);
            const JacobiTransition rule({a, b, c, 0, 1});
            const auto children = rule.children(x, degree, s);
            for (std::size_t i = 0; i < rule.branches(degree); ++i) {
              CHECK((children[i].x >= 0 && children[i].x <= 1));
              CHECK(children[i].weight > 0);
            }
            CHECK(moment(rule, x, degree, s, 0) == Approx(1).epsilon(1e-14));
            const double mean = b == 0 ? x + a * s : std::exp(b * s) * (x + a / b) - a / b;
            CHECK(moment(rule, x, degree, s, 1) == Approx(mean).epsilon(1e-12).margin(1e-15));
            // E x(1-x) decays at the rate c without drift (Wright, Fisher).
            if (a == 0)
              CHECK(mean - moment(rule, x, degree, s, 2) ==
                    Approx(x * (1 - x) * std::exp(-c * s)).epsilon(1e-10).margin(1e-14));
            // Chapman and Kolmogorov: half a step and half a step give the same moments.
            const auto halfway = rule.children(x, degree, s / 2);
            for (int k = 2; k <= degree; ++k) {
              double twice = 0;
              for (std::size_t i = 0; i < rule.branches(degree); ++i)
                twice += halfway[i].weight * moment(rule, halfway[i].x, degree, s / 2, k);
              CHECK(twice == Approx(moment(rule, x, degree, s, k)).epsilon(1e-9).margin(1e-13));
            }
          }
}
