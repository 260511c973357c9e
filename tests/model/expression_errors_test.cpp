// Mistakes in expressions, and whole files that are damaged or too large.
#include <catch2/catch.hpp>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "model/model_mistakes.hpp"

using namespace wienertree;
using namespace wienertree::mistakes;

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
      {"x == v", 2, "equality is not part of the language", "=="},
      {"x != v", 2, "equality is not part of the language", "!="},
      {"0 < x < 1", 6, "comparisons do not chain", "*"},
      {"x and v > 0", 0, "'and' is for comparisons", "x"},
      {"x > 0 or v", 9, "'or' is for comparisons", "v"},
      {"not v", 4, "'not' is for comparisons", "v"},
      {"if(x > 0, v)", 0, "if takes 3 arguments", "*"},
      {"x + and", 4, "'and' stands between two conditions", "*"},
      {"cosinus(x)", 0, "there are sqrt exp log", "cosinus"},
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

TEST_CASE("words of the language are no names") {
  require_error({"kappa = 1.5", "and = 1.5", "m.toml:4:7, parameters.and", "is a word of the language", "*"});
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
