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
  for (const char* f : {"exp(x)",     "log(x)",    "sqrt(x)",     "sin(x)",       "cos(x)",      "tan(x)",
                        "sinh(x)",    "cosh(x)",   "tanh(x)",     "atan(x)",      "erf(x)",      "abs(x)",
                        "abs(x - 2)", "min(x, y)", "max(x, y)",   "min(y, x^2)",  "max(2*y, x)", "x^y",
                        "y^x",        "x^a",       "1/(1 + x^3)", "a^x*erf(b*x)", "abs(x)^3"}) {
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
