// Mistakes in the keys, names, shapes and values of a model file.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "model/model_mistakes.hpp"

using namespace wienertree;
using namespace wienertree::mistakes;

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
  require_error({"scale = 1.0", "scale = \"x - 0.5\"", "m.toml:18:48, observation.noise.scale",
                 "must be positive, and is not at the start", "0"});
  require_error(
      {"dof = 5", "dof = \"x\"", "m.toml:18:37, observation.noise.dof", "a state cannot be used here", "x"});
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

TEST_CASE("nesting deeper than the TOML library's stack allows is refused by its place") {
  const auto repeated = [](const std::string& piece, std::size_t times) {
    std::string text;
    for (std::size_t i = 0; i < times; ++i) text += piece;
    return text;
  };
  for (const std::size_t parts : {33, 40'000}) {
    const std::string key = "a" + repeated(".a", parts - 1);
    for (const std::string& text : {"[" + key + "]\n", "[[" + key + "]]\n", key + " = 1\n",
                                    "a = { " + key + " = 1 }\n", "\"a\"." + key + " = 1\n"}) {
      const Error error = error_of("\n" + text);
      CHECK(error.where() == "m.toml:2");
      CHECK(error.message() == "a key of more than 32 parts");
    }
  }
  for (const std::string& text : {"a = " + repeated("[", 33) + repeated("]", 33),
                                  "a = " + repeated("{ b = ", 33), repeated("[", 100'000),
                                  // A string ends with a quote of its own before the three that close it.
                                  "a = [\"\"\"b\"\"\"\", " + repeated("[", 33)})
    CHECK(error_of("\n\n" + text).message() == "lists and tables nested deeper than 32 levels");
  // What stands in strings and comments is no nesting, numbers have their points, and limits themselves are kept.
  const std::string deep = repeated("a.", 50) + repeated("[", 50);
  for (const std::string& title : {"\"" + deep + "\\\"" + deep + "\"", "'" + deep + "'",
                                   "\"\"\"" + deep + "\"" + deep + "\\\"\"\"\"\"\"",
                                   "'''" + deep + "''" + deep + "'''", "\"m\" # " + deep}) {
    std::string text = good;
    CHECK_NOTHROW(parse_model(text.replace(text.find("\"good\""), 6, title), "m.toml"));
  }
  CHECK(error_of("a = [" + repeated("1.5, ", 100) + "2.5]\n" + good).message().find("unknown key") == 0);
}

TEST_CASE("derivatives beyond a limit are refused before they are taken, with what grew") {
  const auto drift = [](const std::string& expression) {
    return "name = \"m\"\nconvention = \"ito\"\n[state]\nx = { initial = 1.0 }\n[drift]\nx = "
           "\"0\"\n[diffusion]\nx = [\"" +
           expression + "\"]\n";
  };
  std::string product = "cos(x)";
  for (int k = 2; k <= 20; ++k) product += "*cos(" + std::to_string(k) + "*x)";
  CHECK_NOTHROW(parse_model(drift(product), "m.toml"));
  for (int k = 21; k <= 150; ++k) product += "*cos(" + std::to_string(k) + "*x)";
  const Error error = error_of(drift(product));
  CHECK(error.where().starts_with("m.toml:6:"));  // the drift's correction is made of the diffusion
  CHECK(error.message().find("the derivative by x of an expression of ") == 0);
  CHECK(error.message().find("over the limit of 100000: shorten it, its products above all") !=
        std::string::npos);
  // Many derivatives, none of them large.
  std::string states, drifts, diffusions;
  for (int i = 0; i < 60; ++i) {
    const std::string name = "x" + std::to_string(i);
    std::string all = "0";
    for (int j = 0; j < 60; ++j) all += "+sin(x" + std::to_string(j) + "*" + std::to_string(j + 1) + ")^3";
    states += name + " = { initial = 1.0 }\n";
    drifts += name + " = \"" + all + "\"\n";
    diffusions += name + " = [\"" + all + "\", \"1\"]\n";
  }
  CHECK(error_of("name = \"m\"\nconvention = \"ito\"\n[state]\n" + states + "[drift]\n" + drifts +
                 "[diffusion]\n" + diffusions)
            .message()
            .find("grow beyond the limit of 1e+06 in all") != std::string::npos);
}
