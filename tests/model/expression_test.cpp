// The language of expressions: grammar, functions, their derivatives, exactness of numbers.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>

#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

namespace {

TextModel model_of(const std::string& drift) {
  return TextModel::parse(
      "convention = \"stratonovich\"\n[parameters]\na = 2\nb = 3\n[state]\nx = { initial = 0.4 }\n"
      "y = { initial = 0.7 }\n[drift]\nx = \"" +
          drift + "\"\ny = 0\n[diffusion]\nx = [1]\ny = [0]\n",
      "expression.toml");
}

double evaluate(const std::string& expression, double x = 0.4, double y = 0.7) {
  static const TextModel model = model_of("0");
  return value_of(model, expression, {x, y});
}

}  // namespace

TEST_CASE("precedence and associativity") {
  CHECK(evaluate("1 + 2*3") == 7);
  CHECK(evaluate("(1 + 2)*3") == 9);
  CHECK(evaluate("2 - 3 - 4") == -5);
  CHECK(evaluate("2/4/2") == 0.25);
  CHECK(evaluate("2^3^2") == 512);
  CHECK(evaluate("-2^2") == -4);
  CHECK(evaluate("(-2)^2") == 4);
  CHECK(evaluate("2^-2") == 0.25);
  CHECK(evaluate("2*-3") == -6);
  CHECK(evaluate("--2") == 2);
  CHECK(evaluate("-x^2", 3) == -9);
  CHECK(evaluate("2^-x^2", 1) == 0.5);
  CHECK(evaluate("a*b/a*b") == 9);
  CHECK(evaluate(" 1\t+\n2 ") == 3);
  CHECK(evaluate("+1.5e1 - .5 + 2.") == 16.5);
}

TEST_CASE("functions") {
  const double x = 0.4, y = 0.7;
  CHECK(evaluate("exp(x)") == Approx(std::exp(x)).epsilon(1e-15));
  CHECK(evaluate("log(x)") == Approx(std::log(x)).epsilon(1e-15));
  CHECK(evaluate("sqrt(x)") == std::sqrt(x));
  CHECK(evaluate("sin(x)") == Approx(std::sin(x)).epsilon(1e-15));
  CHECK(evaluate("cos(x)") == Approx(std::cos(x)).epsilon(1e-15));
  CHECK(evaluate("tan(x)") == Approx(std::tan(x)).epsilon(1e-15));
  CHECK(evaluate("sinh(x)") == Approx(std::sinh(x)).epsilon(1e-15));
  CHECK(evaluate("cosh(x)") == Approx(std::cosh(x)).epsilon(1e-15));
  CHECK(evaluate("tanh(x)") == Approx(std::tanh(x)).epsilon(1e-15));
  CHECK(evaluate("atan(x)") == Approx(std::atan(x)).epsilon(1e-15));
  CHECK(evaluate("erf(x)") == Approx(std::erf(x)).epsilon(1e-15));
  CHECK(evaluate("abs(-x)") == x);
  CHECK(evaluate("min(x, y) + 10*max(x, y)") == Approx(x + 10 * y).epsilon(1e-15));
  CHECK(evaluate("max(min(x, y), abs(-3))") == 3);
  CHECK(evaluate("pi") == std::acos(-1.0));
  CHECK(evaluate("sin(pi/6)") == 0.5);
  CHECK(evaluate("x^2.5") == Approx(std::pow(x, 2.5)).epsilon(1e-15));
  CHECK(evaluate("x^y") == Approx(std::pow(x, y)).epsilon(1e-15));
  CHECK(evaluate("2^x") == Approx(std::exp2(x)).epsilon(1e-15));
}

TEST_CASE("derivatives of every function agree with finite differences") {
  // Central differences at step 1e-5: truncation and rounding below 1e-9 for these functions.
  for (const char* f : {"exp(x)",
                        "log(x)",
                        "sqrt(x)",
                        "sin(x)",
                        "cos(x)",
                        "tan(x)",
                        "sinh(x)",
                        "cosh(x)",
                        "tanh(x)",
                        "atan(x)",
                        "erf(x)",
                        "abs(x)",
                        "abs(x - 2)",
                        "min(x, y)",
                        "max(x, y)",
                        "min(y, x^2)",
                        "max(2*y, x)",
                        "x^y",
                        "y^x",
                        "x^a",
                        "1/(1 + x^3)",
                        "a^x*erf(b*x)",
                        "abs(x)^3",
                        "asin(x)",
                        "acos(x*y)",
                        "asinh(x)",
                        "acosh(1 + x)",
                        "atanh(x)",
                        "expm1(x)",
                        "log1p(x*y)",
                        "erfc(x)",
                        "normcdf(b*x - y)",
                        "lgamma(x + y)",
                        "digamma(x)",
                        "x*sign(x - y)",
                        "(x > y)*x + (x <= 1)*y",
                        "if(x < y, sin(x), log(x - 1))",
                        "if(x > y and y > 0, sqrt(x - y), x*y)",
                        "lgamma(x*y)"}) {
    INFO(f);
    const TextModel model = model_of(f);
    const VectorFields& fields = *model.model().fields;
    const Point J = jacobian(fields, {0.4, 0.7}, {1, 0});
    const double e = 1e-5;
    const double by_x =
        (direct(fields, {0.4 + e, 0.7}, {1, 0})[0] - direct(fields, {0.4 - e, 0.7}, {1, 0})[0]) / (2 * e);
    const double by_y =
        (direct(fields, {0.4, 0.7 + e}, {1, 0})[0] - direct(fields, {0.4, 0.7 - e}, {1, 0})[0]) / (2 * e);
    CHECK(J[0] == Approx(by_x).margin(1e-8));
    CHECK(J[1] == Approx(by_y).margin(1e-8));
  }
}

TEST_CASE("functions that the C library has or lacks") {
  CHECK(evaluate("asin(x)") == Approx(std::asin(0.4)).epsilon(1e-15));
  CHECK(evaluate("acos(x)") == Approx(std::acos(0.4)).epsilon(1e-15));
  CHECK(evaluate("asinh(x)") == Approx(std::asinh(0.4)).epsilon(1e-15));
  CHECK(evaluate("acosh(1 + x)") == Approx(std::acosh(1.4)).epsilon(1e-15));
  CHECK(evaluate("atanh(x)") == Approx(std::atanh(0.4)).epsilon(1e-15));
  CHECK(evaluate("expm1(x/1e9)") == Approx(std::expm1(0.4e-9)).epsilon(1e-15));
  CHECK(evaluate("log1p(x/1e9)") == Approx(std::log1p(0.4e-9)).epsilon(1e-15));
  CHECK(evaluate("erfc(x)") == Approx(std::erfc(0.4)).epsilon(1e-15));
  CHECK(evaluate("lgamma(x)") == Approx(std::lgamma(0.4)).epsilon(1e-15));
  CHECK(evaluate("normcdf(x)") == Approx(0.65542174161032429).epsilon(1e-15));
  CHECK(evaluate("normcdf(-20 + 0*x)") == Approx(2.7536241186062337e-89).epsilon(1e-14));
  CHECK(evaluate("digamma(1)") == Approx(-0.57721566490153286).epsilon(1e-15));  // minus Euler's constant
  CHECK(evaluate("trigamma(1)") == Approx(std::acos(-1.0) * std::acos(-1.0) / 6).epsilon(1e-15));
  CHECK(evaluate("sign(x) + 10*sign(-y) + 100*sign(x - x)") == -9);
}

TEST_CASE("comparisons are 1 or 0, and if chooses") {
  CHECK(evaluate("x > 0.4") == 0);
  CHECK(evaluate("x >= 0.4") == 1);
  CHECK(evaluate("x < 0.4") == 0);
  CHECK(evaluate("x <= 0.4") == 1);
  CHECK(evaluate("x > y") == 0);
  CHECK(evaluate("x < y") == 1);
  CHECK(evaluate("2*(x < y) + 1") == 3);
  CHECK(evaluate("x < y and y < 1") == 1);
  CHECK(evaluate("x > y or y < 1") == 1);
  CHECK(evaluate("x > y or y > 1") == 0);
  CHECK(evaluate("not x > y and not (y > 1 or x > 1)") == 1);
  CHECK(evaluate("(x > 0.1) + (x > 0.2) + (x > 0.9)") == 2);
  CHECK(evaluate("if(x > y, x, 2*y)") == 1.4);
  CHECK(evaluate("if(x < y, x, 2*y)") == 0.4);
  CHECK(evaluate("if(x > 0, log(x), -1000)", -1) == -1000);  // the other branch has no value there
  CHECK(evaluate("if(x > 0, -1000, sqrt(-x))", -4) == 2);
  CHECK(evaluate("if(1 > 2, x, y)") == 0.7);
  CHECK(evaluate("if(a > b, x, if(a < b, 10*x, y))") == 4);
  CHECK(evaluate("min(x > 0, y > 1)") == 0);
  CHECK(std::isnan(evaluate("x > 0", std::nan(""))));
  // The derivative of the branch that is not taken has no value either.
  const TextModel model = model_of("if(x > 0, x*log(x), x^2)");
  CHECK(jacobian(*model.model().fields, {-1, 0}, {1, 0})[0] == -2);
}

TEST_CASE("conditions are printed in the language") {
  const TextModel model = model_of("if(x > y, max(x, y)^2, sign(x)) + (x >= 1)");
  const ModelAnalysis shown = model.analysis();
  const std::string jacobian = shown.jacobians[0][0];
  INFO(shown.fields[0][0] << "   derivative " << jacobian);
  for (const Point& p : {Point{0.4, 0.7}, Point{1.4, 0.7}, Point{-0.3, -0.2}}) {
    CHECK(value_of(model, shown.fields[0][0], p) ==
          value_of(model, "if(x > y, max(x, y)^2, sign(x)) + (x >= 1)", p));
    CHECK(std::isfinite(value_of(model, jacobian, p)));
  }
}

TEST_CASE("0 log(0) is 0 in a log density") {
  const TextModel model = TextModel::parse(
      "convention = \"ito\"\n[state]\nm = { initial = 1 }\n[drift]\nm = 0\n[diffusion]\nm = [1]\n"
      "[observation]\nkind = \"discrete\"\nlog_likelihood = \"y1*log(m) - m - lgamma(y1 + 1)\"\n",
      "poisson.toml");
  const ObservationDensity& density = *model.model().density;
  CHECK(log_density(density, {0}, {0}) == 0);  // certain
  CHECK(log_density(density, {3}, {0}) == -std::numeric_limits<double>::infinity());
  CHECK(log_density(density, {3}, {2}) == Approx(3 * std::log(2.0) - 2 - std::log(6.0)).epsilon(1e-15));
  CHECK(std::isnan(value_of(model, "(m - 1)*log(m - 1)", {1})));
}

TEST_CASE("decimal numbers reach the tape as the nearest double") {
  for (const char* number :
       {"0.1", "0.3", "1e-3", "123456.789", "1e22", "1e23", "2.2250738585072014e-308",
        "1.7976931348623157e308", "0.1000000000000000055511151231257827", "8.3e-5", "1469.1"}) {
    INFO(number);
    CHECK(evaluate(number) == std::strtod(number, nullptr));
  }
  CHECK(evaluate("0e999999") == 0);
  CHECK(evaluate("0.1 + 0.2") == 0.3);  // numbers are added exactly
}

TEST_CASE("names of GiNaC and of functions are free for states and parameters") {
  const TextModel model = TextModel::parse(
      "convention = \"ito\"\n[parameters]\nI = 2\nEuler = 3\nPi = 5\nD = 7\nbeta = 11\nDigits = 13\n"
      "[state]\nCatalan = { initial = 1 }\nexp = { initial = 2 }\n[drift]\nCatalan = \"I*Euler*Pi\"\nexp = "
      "\"D*exp(exp)\"\n"
      "[diffusion]\nCatalan = [1]\nexp = [\"beta*Digits*exp\"]\n",
      "names.toml");
  const VectorFields& fields = *model.model().fields;
  CHECK(field(fields, 0, {1, 0})[0] == 30);
  CHECK(field(fields, 0, {1, 0})[1] == 7);
  CHECK(field(fields, 1, {1, 2})[1] == 286);
}

TEST_CASE("functions of constants that blow up only where they are multiplied away") {
  CHECK(evaluate("(a - 2)*x") == 0);
  CHECK(evaluate("x^(a - 2)") == 1);
  CHECK(evaluate("x/x") == 1);
  CHECK(evaluate("sqrt(x)*sqrt(x)") == 0.4);
}

TEST_CASE("large powers keep their value") {
  CHECK(evaluate("1.0001^10000") == Approx(std::pow(1.0001, 10000)));
  CHECK(evaluate("2^1000") == std::ldexp(1.0, 1000));
  CHECK(evaluate("2^-1000") == std::ldexp(1.0, -1000));
  CHECK(evaluate("(1 + 1e-12)^1000000") == Approx(std::pow(1 + 1e-12, 1000000)));
  CHECK(evaluate("x^100", 1.01) == Approx(std::pow(1.01, 100)).epsilon(1e-13));
}
