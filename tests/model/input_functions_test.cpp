// Known functions of time, and a clock that tells on which side of a jump it is.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

namespace {

const InputFunctions functions({{"u", Between::previous, {0, 1, 2, 5}, {1, 4, 4, -2}},
                                {"v", Between::linear, {0, 2, 5}, {0, 3, -3}}},
                               "f.csv");

// t, u, u', v, v' at a clock.
std::vector<double> at(double clock) {
  std::vector<double> values(functions.columns());
  std::vector<double*> out;
  for (double& value : values) out.push_back(&value);
  functions.evaluate({&clock, 1}, out);
  return values;
}

}  // namespace

TEST_CASE("inputs between their times, and at their jumps") {
  CHECK(std::vector<double>(functions.jumps().begin(), functions.jumps().end()) == std::vector<double>{1, 5});
  CHECK(at(functions.clock(0.5)) == std::vector<double>{0.5, 1, 0, 0.75, 1.5});
  CHECK(at(functions.clock(1)) == std::vector<double>{1, 4, 0, 1.5, 1.5});
  CHECK(at(functions.clock(3)) == std::vector<double>{3, 4, 0, 1, -2});
  // A step from 0.5 ends at the jump, and beyond it, with the value before.
  for (const double step : {0.5, 0.75, -1.0}) CHECK(at(functions.clock(0.5) + step)[1] == 1);
  CHECK(at(functions.clock(0.5) + 0.5)[0] == 1);
  CHECK(at(functions.clock(1) - 0.5)[1] == 4);
  // A time that is a jump but for rounding.
  CHECK(at(functions.clock(0.1 + 0.2 + 0.7 - 1e-16))[1] == 4);
  CHECK(at(functions.clock(std::nextafter(1.0, 0.0)))[1] == 4);
  CHECK(at(functions.clock(1 - 1e-9))[1] == 1);
  CHECK(std::isnan(at(std::numeric_limits<double>::quiet_NaN())[1]));
  // Outside they keep their values.
  CHECK(at(functions.clock(7)) == std::vector<double>{7, -2, 0, -3, 0});
  CHECK(at(-1) == std::vector<double>{-1, 1, 0, 0, 0});
  CHECK_NOTHROW(functions.require_span(0, 5, "it"));
  CHECK_THROWS_AS(functions.require_span(0, 5.001, "it"), InputError);
  CHECK_THROWS_AS(functions.require_span(-0.001, 5, "it"), InputError);
}

TEST_CASE("a node's inputs do not depend on where it sits") {
  std::vector<double> clock;
  for (int n = 0; n < 40; ++n) clock.push_back(functions.clock(0.125 * (n / 3)));
  std::vector<std::vector<double>> values(functions.columns(), std::vector<double>(clock.size()));
  std::vector<double*> out;
  for (auto& column : values) out.push_back(column.data());
  functions.evaluate(clock, out);
  for (std::size_t n = 0; n < clock.size(); ++n)
    for (std::size_t c = 0; c < values.size(); ++c) CHECK(values[c][n] == at(clock[n])[c]);
}

TEST_CASE("coefficients with inputs: values, the clock's derivative, the sensor and expressions") {
  const TextModel text = TextModel::parse(
      "convention = \"ito\"\n[parameters]\na = 2\n[inputs]\nu = { between = \"previous\" }\nv = { between = "
      "\"linear\" }\n[state]\nx = { initial = 0.3 }\n[drift]\nx = \"a*v - u*x + t\"\n[diffusion]\nx = "
      "[\"v^2*x\"]\n"
      "[observation]\nkind = \"discrete\"\nlog_likelihood = \"-(y1 - u*x)^2 - v\"\n",
      "m.toml");
  CHECK_FALSE(text.model().inputs->known());
  CHECK_THROWS_AS(field(*text.model().fields, 0, {1, 0}), InputError);
  const TextModel known = text.with_inputs(functions.functions(), "f.csv");
  const Model& m = known.model();
  CHECK(m.has_clock);
  const double x = 0.7, clock = m.clock(3), v = 1, u = 4, t = 3, slope = -2;
  CHECK(ito_drift(*m.fields, {x, clock}) == Point{2 * v - u * x + t, 1});
  CHECK(field(*m.fields, 1, {x, clock}) == Point{v * v * x, 0});
  CHECK(field(*m.fields, 0, {x, clock})[0] == Approx(2 * v - u * x + t - x / 2).epsilon(1e-14));
  const Point J = jacobian(*m.fields, {x, clock}, {1, 0});
  CHECK(J[0] == Approx(-u - 0.5).epsilon(1e-14));
  CHECK(J[1] == Approx(2 * slope + 1 - 2 * slope * x).epsilon(1e-14));  // d/dt of a v + t - v^4 x/2
  CHECK(jacobian(*m.fields, {x, clock}, {0, 1})[1] == Approx(2 * v * slope * x).epsilon(1e-14));
  CHECK(value_of(known, "x + 10*u + 100*v + 1000*t", {x, clock}) == Approx(3140.7).epsilon(1e-14));
  CHECK(log_density(*m.density, {1}, {x, clock}) == Approx(-std::pow(1 - u * x, 2) - v).epsilon(1e-14));
  CHECK(known.with_integrals({{"I", "u*x", "test"}}).model().inputs->known());
  const ModelAnalysis shown = known.analysis();
  CHECK(shown.jacobians[1] == std::vector<std::string>{"v^2", "2*x*v*v'", "0", "0"});
}

TEST_CASE("mistakes in [inputs]") {
  const auto refused = [](const std::string& inputs, const std::string& message,
                          const std::string& drift = "x") {
    try {
      parse_model("convention = \"ito\"\n[parameters]\na = 2\n[inputs]\n" + inputs +
                      "\n[state]\nx = { initial = \"a\" }\n[drift]\nx = \"" + drift +
                      "\"\n[diffusion]\nx = [1]\n",
                  "m.toml");
    } catch (const InputError& error) {
      INFO(error.what());
      CHECK(std::string(error.what()).find(message) != std::string::npos);
      return;
    }
    FAIL("no InputError");
  };
  refused("u = { between = \"liner\" }",
          "m.toml:5:17, inputs.u.between: must be one of linear, previous, did you mean 'linear'?");
  refused("u = {}", "inputs.u.between: missing key");
  refused("u = 1", "m.toml:5:5, inputs.u: must be a table");
  refused("a = { between = \"linear\" }", "already that of a parameter");
  refused("x = { between = \"linear\" }", "already that of an input");
  refused("t = { between = \"linear\" }", "the name of the time");
  refused("y1 = { between = \"linear\" }", "rename this");
  refused("", "names at least one input");
  refused("u = { between = \"linear\" }", "did you mean 'u'?", "uu");
  refused(
      "u = { between = \"linear\" }\nw = { between = \"linear\" }\n[initial]\nmean = [\"u\"]\ncovariance = "
      "[[1]]",
      "an input cannot be used here");
}
