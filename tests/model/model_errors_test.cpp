// Every mistake in a model file gives one InputError that says what, where (file:line:column, key) and the
// value.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "wienertree/model/text_model.hpp"

using namespace wienertree;

namespace {

const std::string good =
    "name = \"good\"\n"                                        // 1
    "convention = \"ito\"\n"                                   // 2
    "[parameters]\n"                                           // 3
    "kappa = 1.5\n"                                            // 4
    "theta = \"kappa/2\"\n"                                    // 5
    "[state]\n"                                                // 6
    "x = { initial = 0.5, lower = 0.0, upper = 9.0 }\n"        // 7
    "v = { initial = 1.0 }\n"                                  // 8
    "[drift]\n"                                                // 9
    "x = \"kappa*(theta - x)\"\n"                              // 10
    "v = \"-v\"\n"                                             // 11
    "[diffusion]\n"                                            // 12
    "x = [\"sqrt(x)\", \"0\"]\n"                               // 13
    "v = [\"0.1\", \"0.2*v\"]\n"                               // 14
    "[observation]\n"                                          // 15
    "kind = \"discrete\"\n"                                    // 16
    "h = [\"x\", \"v\"]\n"                                     // 17
    "noise = { law = \"student-t\", dof = 5, scale = 1.0 }\n"  // 18
    "timing = \"current\"\n"                                   // 19
    "[initial]\n"                                              // 20
    "mean = [0.5, 1.0]\n"                                      // 21
    "covariance = [[0.2, 0.1], [0.1, 0.3]]\n";                 // 22

struct Mistake {
  std::string from, to;     // the first `from` is replaced by `to`
  std::string where;        // the whole place
  std::string message;      // part of the message
  std::string value = "*";  // the whole value; "*": any
};

Error error_of(const std::string& text, const ParameterOverrides& overrides = {}) {
  try {
    parse_model(text, "m.toml", overrides);
  } catch (const InputError& error) {
    return error;
  }
  FAIL("no InputError");
  return {"", ""};
}

void require_error(const Mistake& mistake) {
  INFO(mistake.from << " -> " << mistake.to);
  const std::size_t place = good.find(mistake.from);
  REQUIRE(place != std::string::npos);
  std::string text = good;
  text.replace(place, mistake.from.size(), mistake.to);
  const Error error = error_of(text);
  INFO(error.what());
  CHECK(error.where() == mistake.where);
  CHECK(error.message().find(mistake.message) != std::string::npos);
  if (mistake.value != "*") CHECK(error.value() == mistake.value);
  CHECK(std::string(error.what()).find('\n') == std::string::npos);
}

}  // namespace

TEST_CASE("the model that the mistakes are made in is good") {
  CHECK(parse_model(good, "m.toml").name == "good");
}

TEST_CASE("mistakes in keys and sections") {
  const std::vector<Mistake> mistakes{
      {"name = \"good\"", "nme = \"good\"", "m.toml:1:1, nme", "unknown key, did you mean 'name'?", "nme"},
      {"[drift]", "[drfit]", "m.toml:9:2, drfit", "unknown key, did you mean 'drift'?", "drfit"},
      {"[drift]\nx = \"kappa*(theta - x)\"\nv = \"-v\"\n", "", "m.toml:1:1, drift", "missing key"},
      {"convention = \"ito\"\n", "", "m.toml:1:1, convention", "missing key"},
      {"\"ito\"", "\"itoo\"", "m.toml:2:14, convention",
       "must be one of ito, stratonovich, did you mean 'ito'?", "itoo"},
      {"\"ito\"", "3", "m.toml:2:14, convention", "must be a string, not a number", "3"},
      {"name = \"good\"", "name = [1]", "m.toml:1:8, name", "must be a string, not a list"},
      {"[state]\n", "[state]\nw = 1\n", "m.toml:7:5, state.w", "must be a table, not a number", "1"},
      {"lower = 0.0", "lowr = 0.0", "m.toml:7:22, state.x.lowr", "unknown key, did you mean 'lower'?",
       "lowr"},
      {"lower = 0.0", "boundary = \"clmap\"", "m.toml:7:33, state.x.boundary", "did you mean 'clamp'?",
       "clmap"},
      {"{ initial = 1.0 }", "{ initial = 1.0, boundary = \"clamp\" }", "m.toml:8:33, state.v.boundary",
       "needs `lower` or `upper`"},
      {"kind = \"discrete\"", "kind = \"discreet\"", "m.toml:16:8, observation.kind",
       "did you mean 'discrete'?"},
      {"timing = \"current\"", "timing = \"now\"", "m.toml:19:10, observation.timing",
       "must be one of current, previous", "now"},
      {"h = [\"x\", \"v\"]\n", "", "m.toml:15:1, observation.h", "missing key"},
      {"h = [\"x\", \"v\"]", "h = \"x\"", "m.toml:17:5, observation.h",
       "must be a list of expressions, not a string", "x"},
      {"h = [\"x\", \"v\"]", "h = []", "m.toml:17:5, observation.h", "at least one expression"},
      {"law = \"student-t\"", "law = \"student\"", "m.toml:18:17, observation.noise.law",
       "must be one of gaussian", "student"},
      {"dof = 5, ", "", "m.toml:18:9, observation.noise.dof", "missing key"},
      {"dof = 5", "dof = 5, sd = 1", "m.toml:18:44, observation.noise.sd", "student-t has no such parameter",
       "sd"},
      {"dof = 5", "dof = \"kappa - 2\"", "m.toml:18:37, observation.noise.dof", "must be positive", "-0.5"},
      {"kind = \"discrete\"", "kind = \"continuous\"", "m.toml:18:9, observation.noise",
       "discrete observations"},
      {"h = [\"x\", \"v\"]", "log_likelihood = \"-(y1 - x)^2\"\nh = [\"x\"]", "m.toml:18:5, observation.h",
       "`log_likelihood` stands instead of"},
      {"[initial]", "[exact]\nfilter = \"kalmann\"\n[initial]", "m.toml:21:10, exact.filter",
       "did you mean 'kalman'?"},
      {"[initial]", "[exact]\nfiltre = \"kalman\"\n[initial]", "m.toml:21:1, exact.filtre",
       "did you mean 'filter'?"},
  };
  for (const Mistake& mistake : mistakes) require_error(mistake);
}

TEST_CASE("TOML syntax errors name the line") {
  require_error({"kappa = 1.5", "kappa = ", "m.toml:4:9", "TOML syntax"});
  require_error({"kappa = 1.5", "kappa = 1.5\nkappa = 2", "m.toml:5:9", "TOML syntax"});
  require_error({"[drift]", "[drift", "m.toml:9:7", "TOML syntax"});
  require_error({"\"-v\"", "\"-v", "m.toml:11:8", "TOML syntax"});
  CHECK(error_of(std::string("a = \"\xff\"", 8)).message().find("TOML syntax") == 0);
}

TEST_CASE("mistakes in names") {
  require_error(
      {"[parameters]\n", "[parameters]\nx = 1\n", "m.toml:8:5, state.x", "already that of a parameter", "x"});
  require_error({"kappa = 1.5", "t = 1.5", "m.toml:4:5, parameters.t", "'t' is the name of the time"});
  require_error({"kappa = 1.5", "pi = 1.5", "m.toml:4:6, parameters.pi", "the constant"});
  require_error(
      {"kappa = 1.5", "\"2k\" = 1.5", "m.toml:4:8, parameters.2k", "does not start with a digit", "2k"});
  require_error({"[drift]\nx = ", "[drift]\nxx = 1\nx = ", "m.toml:10:6, drift.xx", "no such state", "xx"});
  require_error({"v = \"-v\"\n", "", "m.toml:9:1, drift.v", "missing key"});
  require_error({"v = [\"0.1\", \"0.2*v\"]\n", "", "m.toml:12:1, diffusion.v", "missing key"});
  const Error no_start =
      error_of("convention = \"ito\"\n[state]\nx = { lower = 0 }\n[drift]\nx = 0\n[diffusion]\nx = [1]\n");
  CHECK(no_start.where() == "m.toml:3:5, state.x");
  CHECK(no_start.message() == "missing key `initial`");
  const std::string clash =
      "convention = \"ito\"\n[state]\ny1 = { initial = 0 }\n[drift]\ny1 = 0\n[diffusion]\ny1 = [1]\n"
      "[observation]\nkind = \"discrete\"\nlog_likelihood = \"-y1^2\"\n";
  CHECK(error_of(clash).where() == "m.toml:10:19, observation.log_likelihood");
  CHECK(error_of(clash).value() == "y1");
}

TEST_CASE("wrong shapes") {
  require_error({"[\"0.1\", \"0.2*v\"]", "[\"0.1\"]", "m.toml:14:5, diffusion.v",
                 "one entry per Brownian motion, 2 as for x", "1"});
  require_error({"[\"sqrt(x)\", \"0\"]", "[]", "m.toml:13:5, diffusion.x", "at least one"});
  require_error(
      {"[\"sqrt(x)\", \"0\"]", "\"1\"", "m.toml:13:5, diffusion.x", "must be a list of expressions"});
  require_error({"[\"sqrt(x)\", \"0\"]", "[[\"1\"], \"0\"]", "m.toml:13:6, diffusion.x[1]",
                 "must be an expression or a number, not a list"});
  require_error(
      {"noise = { law = \"student-t\", dof = 5, scale = 1.0 }",
       "noise = [{ law = \"log-chi-square\" }, { law = \"log-chi-square\" }, { law = \"log-chi-square\" }]",
       "m.toml:18:9, observation.noise", "one for each of 2", "3"});
  require_error({"mean = [0.5, 1.0]", "mean = [0.5]", "m.toml:21:8, initial.mean", "needs 2 entries", "1"});
  require_error(
      {"[[0.2, 0.1], [0.1, 0.3]]", "[[0.2, 0.1]]", "m.toml:22:14, initial.covariance", "needs 2 rows", "1"});
  require_error({"[[0.2, 0.1], [0.1, 0.3]]", "[[0.2, 0.1], [0.1]]", "m.toml:22:14, initial.covariance",
                 "needs 2 entries", "1"});
  require_error({"[[0.2, 0.1], [0.1, 0.3]]", "[0.2, 0.3]", "m.toml:22:15, initial.covariance[1]",
                 "must be a list of expressions, not a number"});
}

TEST_CASE("values out of range") {
  require_error({"kappa = 1.5", "kappa = nan", "m.toml:4:9, parameters.kappa", "finite", "nan"});
  require_error({"kappa = 1.5", "kappa = -inf", "m.toml:4:9, parameters.kappa", "finite", "-inf"});
  require_error({"kappa = 1.5", "kappa = true", "m.toml:4:9, parameters.kappa",
                 "must be an expression or a number, not a boolean", "true"});
  require_error({"kappa = 1.5", "kappa = 0\nbad = \"1/kappa\"", "m.toml:5:8, parameters.bad",
                 "no finite value", "1/kappa"});
  require_error({"mean = [0.5, 1.0]", "mean = [\"-kappa\", 1.0]", "m.toml:21:10, initial.mean[1]",
                 "outside the bounds [0, 9]", "-1.5"});
  require_error(
      {"{ initial = 1.0 }", "{ initial = 2.0 }", "m.toml:8:17, state.v.initial", "given twice", "2 and 1"});
  require_error({"upper = 9.0", "upper = -9.0", "m.toml:7:5, state.x", "`lower` must be below `upper`",
                 "lower = 0, upper = -9"});
  require_error({"[0.1, 0.3]]", "[0.2, 0.3]]", "m.toml:22:28, initial.covariance[2][1]", "not symmetric",
                 "0.2 and 0.1"});
  require_error({"[[0.2, 0.1], [0.1, 0.3]]", "[[0.2, 0.5], [0.5, 0.3]]", "m.toml:20:1, initial.covariance",
                 "negative eigenvalue"});
  require_error({"\"-v\"", "\"log(v - 2)\"", "m.toml:11:6, drift.v", "not finite at the start", "nan"});
  require_error(
      {"\"0.2*v\"", "\"1/(v - 1)\"", "m.toml:14:14, diffusion.v[2]", "not finite at the start", "-inf"});
  require_error({"h = [\"x\", \"v\"]", "h = [\"x\", \"1/(v-1)\"]", "m.toml:17:12, observation.h[2]",
                 "not finite at the start", "-inf"});
}

TEST_CASE("mistakes in expressions name the column") {
  const std::vector<std::tuple<std::string, std::size_t, std::string, std::string>> mistakes{
      {"kapa*x", 0, "unknown name, did you mean 'kappa'?", "kapa"},
      {"1 + thta", 4, "did you mean 'theta'?", "thta"},
      {"zzzzzz", 0, "unknown name", "zzzzzz"},
      {"cosinus(x)", 0, "unknown function", "cosinus"},
      {"tahn(x)", 0, "unknown function, did you mean 'tanh'?", "tahn"},
      {"kappa(x)", 0, "'kappa' is not a function", "*"},
      {"exp", 0, "needs its argument in parentheses", "*"},
      {"exp(x, v)", 0, "exp takes 1 argument, not 2", "*"},
      {"max(x)", 0, "max takes 2 arguments, not 1", "*"},
      {"sin()", 0, "sin takes 1 argument, not 0", "*"},
      {"", 0, "empty expression", "*"},
      {"x +", 3, "ends too early", "*"},
      {"x + * v", 4, "unexpected symbol", "*"},
      {"(x + v", 0, "missing ')'", "*"},
      {"x + v)", 5, "unexpected ')'", "*"},
      {"2x", 0, "malformed number", "2x"},
      {"2 x", 2, "missing operator", "x"},
      {"x (v)", 0, "'x' is not a function", "*"},
      {"x**2", 2, "a power is written with '^'", "*"},
      {"1.2.3", 0, "malformed number", "*"},
      {"x = 2", 2, "unexpected character", "="},
      {"x & v", 2, "unexpected character", "&"},
      {"x + \xc3\xa9", 4, "unexpected character", "\xc3\xa9"},
      {"1e999", 0, "out of the range of double precision", "1e999"},
      {"1e-310", 0, "out of the range of double precision", "1e-310"},
      {"1e-999", 0, "out of the range of double precision", "1e-999"},
      {"x/0", 1, "division by zero", "*"},
      {"x/(1 - 1)", 1, "division by zero", "*"},
      {"0^-1", 1, "division by zero", "*"},
      {"log(0)", 0, "log of a number that is not positive", "0"},
      {"log(-2)", 0, "log of a number that is not positive", "-2"},
      {"sqrt(-1)", 0, "sqrt of a negative number", "-1"},
      {"(-1)^0.5", 4, "not real", "*"},
      {"tan(pi/2)", 0, "no finite value", "*"},
      {"10^400", 2, "power is not finite", "*"},
      {"2^100000000000", 1, "power is not finite", "*"},
      {"x^5000", 1, "exponent larger than 1000", "5000"},
      {"(x^900)^900", 7, "exponent larger than 1000", "*"},
      {"((2*x)^1000)^1000", 12, "exponent larger than 1000", "*"},
      {"y1", 0, "unknown name", "y1"},
      {"max(x, v", 3, "missing ')'", "*"},
      {"x, v", 1, "unexpected symbol", ","},
  };
  for (const auto& [expression, offset, message, value] : mistakes) {
    require_error({"\"-v\"", "\"" + expression + "\"",
                   "m.toml:11:" + std::to_string(6 + offset) + ", drift.v", message, value});
  }
  // Where escapes or lines break the count, the place of the string stands.
  require_error({"\"-v\"", "\"\"\"\n-v +\n\"\"\"", "m.toml:11:5, drift.v", "ends too early"});
}

TEST_CASE("what a scope allows") {
  require_error({"initial = 0.5", "initial = \"v\"", "m.toml:7:18, state.x.initial",
                 "a state cannot be used here", "v"});
  require_error(
      {"initial = 0.5", "initial = \"t\"", "m.toml:7:18, state.x.initial", "time cannot be used here", "t"});
  require_error({"kappa = 1.5", "kappa = \"theta\"", "m.toml:4:10, parameters.kappa",
                 "earlier parameters only", "theta"});
  require_error({"kappa = 1.5", "kappa = \"kappa\"", "m.toml:4:10, parameters.kappa",
                 "earlier parameters only", "kappa"});
  const std::string no_y =
      "convention = \"ito\"\n[state]\nx = { initial = 0 }\n[drift]\nx = 0\n[diffusion]\nx = [1]\n"
      "[observation]\nkind = \"discrete\"\nlog_likelihood = \"-x^2\"\n";
  CHECK(error_of(no_y).message().find("must depend on the observation") == 0);
}

TEST_CASE("constants without a finite value are found when they are known") {
  const std::string text =
      "convention = \"ito\"\n[parameters]\nrho = 0.5\n[state]\nx = { initial = 1 }\n[drift]\nx = 0\n"
      "[diffusion]\nx = [\"x*sqrt(1 - rho^2)\"]\n";
  CHECK_NOTHROW(parse_model(text, "m.toml"));
  const Error error = error_of(text, {{"rho", 2}});
  CHECK(error.where() == "m.toml:9:7, diffusion.x[1]");
  CHECK(error.message().find("no finite value") != std::string::npos);
}

TEST_CASE("overrides: unknown names suggest the nearest, values are finite") {
  const Error unknown = error_of(good, {{"kapa", 1}});
  CHECK(unknown.where() == "m.toml, override of kapa");
  CHECK(unknown.message() == "unknown parameter, did you mean 'kappa'?");
  CHECK(unknown.value() == "kapa");
  CHECK(error_of(good, {{"kappa", std::nan("")}}).value() == "nan");
  CHECK(error_of(good, {{"kappa", -std::numeric_limits<double>::infinity()}}).value() == "-inf");
}

TEST_CASE("a wrong claim of an exact filter names the coefficient that differs") {
  const auto claim = [](const std::string& drift, const std::string& diffusion, const std::string& h,
                        const std::string& filter, const std::string& more = "") {
    return error_of(
        "convention = \"ito\"\n[parameters]\nmu = 0.5\nsigma = 0.8\n[state]\nx = { initial = 0 }\n[drift]\nx "
        "= \"" +
        drift + "\"\n[diffusion]\nx = [" + diffusion + "]\n[observation]\nkind = \"continuous\"\nh = [" + h +
        "]\n" + more + "[exact]\nfilter = \"" + filter + "\"\n");
  };
  const auto names = [](const Error& error, const std::string& coefficient) {
    INFO(error.what());
    CHECK(error.message().find("does not apply: ") != std::string::npos);
    CHECK(error.message().find(coefficient) != std::string::npos);
    CHECK(error.where().find("exact.filter") != std::string::npos);
  };
  // The misprint mu sigma tanh(mu sigma x) found in the literature.
  names(claim("mu*sigma*tanh(mu*sigma*x)", "\"sigma\"", "\"x\"", "benes"), "drift.x at x = ");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma*x\"", "\"x\"", "benes"), "diffusion.x is not a constant");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "0", "\"x\"", "benes"), "diffusion.x is not a constant");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma\"", "\"x^2\"", "benes"),
        "observation.h[1] is not affine");
  names(claim("-x", "\"sigma\"", "\"x\"", "benes"), "drift.x is no mu*sigma*tanh");
  names(claim("abs(x)", "\"sigma\"", "\"x\"", "benes"), "drift.x is not analytic");
  names(claim("t", "\"sigma\"", "\"x\"", "benes"), "depends on the time");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma\", 1", "\"x\"", "benes"), "2 Brownian motions");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma\"", "\"x\", \"x\"", "benes"), "h has 2 components");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma\"", "\"x\"", "benes",
              "[initial]\nmean = [0]\ncovariance = [[1]]\n"),
        "the start is random");
  names(claim("mu*sigma*tanh(mu*x/sigma)", "\"sigma\"", "\"x\"", "kalman-bucy"), "drift.x is not affine");
  names(claim("-x", "\"x\"", "\"x\"", "kalman-bucy"), "diffusion.x[1] depends on the state");
  names(claim("-x", "1", "\"sin(x)\"", "kalman-bucy"), "observation.h[1] is not affine");
  names(claim("-x", "1", "\"x\"", "kalman"), "the observation is not discrete");
}

TEST_CASE("huge and deep expressions are refused, not followed into the stack") {
  const auto with_drift = [](const std::string& expression) {
    std::string text = good;
    text.replace(text.find("\"-v\""), 4, "\"" + expression + "\"");
    return error_of(text);
  };
  const std::size_t n = 100000;
  const auto repeat = [](const char* s, std::size_t times) {
    std::string result;
    for (std::size_t i = 0; i < times; ++i) result += s;
    return result;
  };
  CHECK(with_drift(repeat("(", n) + "v" + repeat(")", n)).message().find("more than 10000 symbols") !=
        std::string::npos);
  CHECK(with_drift(repeat("(", 4000) + "v" + repeat(")", 4000)).message().find("nested deeper") !=
        std::string::npos);
  CHECK(with_drift(repeat("-", 5000) + "v").message().find("nested deeper") != std::string::npos);
  CHECK(with_drift(repeat("v^", 3000) + "v").message().find("nested deeper") != std::string::npos);
  CHECK(with_drift(repeat("sin(", 3000) + "v" + repeat(")", 3000)).message().find("nested deeper") !=
        std::string::npos);
  CHECK(with_drift(repeat("9", n)).message().find("digits") != std::string::npos);
  CHECK(with_drift(repeat("1+", n) + "v").message().find("more than 10000 symbols") != std::string::npos);
  // Deep but allowed.
  std::string text = good, deep = "\"";
  deep += repeat("sin(", 150);
  deep += "v";
  deep += repeat(")", 150);
  deep += "\"";
  text.replace(text.find("\"-v\""), 4, deep);
  CHECK_NOTHROW(parse_model(text, "m.toml"));
}

TEST_CASE("errors of standalone expressions name the column") {
  const TextModel model = TextModel::parse(good, "m.toml");
  const auto error = [&](const std::string& expression) -> Error {
    try {
      model.compile(expression, "--payoff");
    } catch (const InputError& e) {
      return e;
    }
    FAIL("no InputError");
    return {"", ""};
  };
  CHECK(error("max(w - 1, 0)").where() == "--payoff:1:5");
  CHECK(error("max(w - 1, 0)").value() == "w");
  CHECK(error("x*t").message().find("does not depend on the time") != std::string::npos);
  CHECK(error("1/(kappa - 1.5)").message().find("no finite value") != std::string::npos);
}

TEST_CASE("files that cannot be read") {
  CHECK_THROWS_AS(load_model("/nonexistent/model.toml"), InputError);
  CHECK_THROWS_AS(load_model("/"), InputError);
  CHECK_THROWS_AS(load_model("/dev/zero"), InputError);
  try {
    load_model("/nonexistent/model.toml");
  } catch (const InputError& error) {
    CHECK(error.where() == "/nonexistent/model.toml");
    CHECK(error.value() == "No such file or directory");
  }
}

TEST_CASE("random damage gives a model or an InputError, nothing else") {
  std::mt19937_64 random(1);
  const std::string letters = "xvk0159.+-*/^()[]{}\"=,\n e#'\\\xc3";
  for (int trial = 0; trial < 1500; ++trial) {
    std::string text = good;
    const std::size_t damages = 1 + random() % 4;
    for (std::size_t i = 0; i < damages; ++i) {
      const std::size_t place = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[place] = letters[random() % letters.size()];
          break;
        case 1:
          text.erase(place, 1 + random() % 5);
          break;
        default:
          text.insert(place, 1, letters[random() % letters.size()]);
      }
    }
    INFO(text);
    try {
      parse_model(text, "m.toml");
    } catch (const InputError& error) {
      CHECK(error.where().find("m.toml") == 0);
    }
  }
}
