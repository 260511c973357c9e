#include "wienertree/cubature/lie_formula.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <random>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/lie_formula_file.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;

namespace {

LieBracket bracket(const std::string& text) { return LieBracket::parse(text, "test"); }

TensorSeries tensor(const std::string& text, int p, int degree) {
  TensorSeries L(p, degree);
  for (const auto& [word, sign] : bracket(text).expand()) L[word] += sign;
  return L;
}

const char* const valid =
    R"({"kind": "lie", "name": "n", "degree": 1, "dimension": 1, "source": "s", "elements": [
  {"weight": 1, "terms": [{"bracket": "0", "coefficient": 1}]}]})";

std::string message_of(std::string text, const std::string& from = "", const std::string& to = "") {
  text.replace(text.find(from), from.size(), to);
  try {
    const LieFormula formula = parse_lie_formula(text, "f.json");
    require_holds(verify(formula), "f.json");
    return "accepted";
  } catch (const InputError& error) {
    return error.what();
  }
}

}  // namespace

TEST_CASE("Brackets are read and printed") {
  for (const std::string text : {"0", "12", "[0,1]", "[[0,1],1]", "[[1,2],[0,[1,2]]]"})
    CHECK(bracket(text).to_string() == text);
  CHECK(bracket(" [ [0, 1] ,1 ] ").to_string() == "[[0,1],1]");
  CHECK(bracket("[[0,1],1]").degree() == 4);
  CHECK(bracket("[[0,3],1]").largest_letter() == 3);
  for (const std::string text :
       {"", "[", "[0]", "[0,1", "[0,1]]", "[0,1],1", "-1", "a", "[0,,1]", "99999999999"})
    CHECK_THROWS_AS(bracket(text), InputError);
  CHECK_THROWS_AS(bracket(std::string(100000, '[')), InputError);
}

TEST_CASE("Brackets expand antisymmetrically and satisfy Jacobi's identity") {
  const int p = 2, m = 4;
  const TensorSeries ab = tensor("[1,2]", p, m);
  CHECK(ab[Word{1, 2}] == 1);
  CHECK(ab[Word{2, 1}] == -1);
  const TensorSeries nested = tensor("[[0,1],1]", p, m);  // 0 1 1 - 2 1 0 1 + 1 1 0
  CHECK(nested[Word{0, 1, 1}] == 1);
  CHECK(nested[Word{1, 0, 1}] == -2);
  CHECK(nested[Word{1, 1, 0}] == 1);
  const Eigen::VectorXd jacobi = tensor("[[0,1],2]", p, m).coefficients +
                                 tensor("[[1,2],0]", p, m).coefficients +
                                 tensor("[[2,0],1]", p, m).coefficients;
  CHECK(jacobi.norm() == 0);
}

TEST_CASE("The exponential of a Lie element without brackets is a straight path") {
  const LieElement element{1, {{bracket("0"), 1}, {bracket("1"), 0.7}, {bracket("2"), -0.3}}};
  CubaturePath path{1, Eigen::MatrixXd(3, 1)};
  path.increments << 1, 0.7, -0.3;
  const TensorSeries difference = signature(element, 2, 6);
  CHECK((difference.coefficients - signature(path, 6).coefficients).lpNorm<Eigen::Infinity>() < 1e-15);
}

TEST_CASE("Lie-polynomial formulas have exactly degree 5, for every dimension") {
  for (int p = 1; p <= 5; ++p) {
    const FormulaVerification verification = verify(construct_lie_5(p));
    INFO(p << ": " << verification.brief());
    CHECK(verification.max_error < 1e-14);
    CHECK(verification.degree == 5);
  }
}

TEST_CASE("Any x gives degree 5, any other coefficient does not") {
  for (const double x : {0.0, 0.2, 1.0, -3.0})
    CHECK(verify(construct_lie_5(gaussian_cubature_5(2), x)).max_error < 1e-13);
  for (std::size_t term = 0; term < 8; ++term) {
    LieFormula formula = construct_lie_5(2);
    REQUIRE(formula.elements[3].terms.size() == 8);
    formula.elements[3].terms[term].coefficient += 1e-6;
    CHECK_FALSE(verify(formula).holds());
  }
  CHECK_THROWS_AS(construct_lie_5(gaussian_cubature_5(2), std::nan("")), InputError);
  CHECK_THROWS_AS(construct_lie_5(17), InputError);
}

TEST_CASE("A Lie-polynomial formula survives writing and reading bit for bit") {
  const LieFormula formula = construct_lie_5(3);
  const auto file = std::filesystem::temp_directory_path() /
                    ("wienertree-lie-formula-test-" + std::to_string(std::random_device{}()) + ".json");
  save_formula(formula, file);
  const LieFormula again = load_lie_formula(file);
  CHECK(format_formula(again) == format_formula(formula));
  CHECK_THROWS_AS(load_formula(file), InputError);
  std::filesystem::remove(file);
}

TEST_CASE("Malformed Lie-polynomial formulas are refused with file, place and key") {
  CHECK(message_of(valid) == "accepted");
  CHECK(message_of(valid, "\"lie\"", "\"path\"") == "f.json: \"kind\" must be \"lie\" (\"path\")");
  CHECK(message_of(valid, "\"terms\"", "\"words\"") ==
        "f.json: element 1: unknown key; the keys are weight, terms (words)");
  CHECK(message_of(valid, "\"weight\": 1", "\"weight\": -1") ==
        "f.json: element 1: a weight must be positive and finite (-1)");
  CHECK(message_of(valid, "\"0\"", "\"2\"") ==
        "f.json: element 1, term 1: the letters of a formula of dimension 1 are 0 to 1 (2)");
  CHECK(message_of(valid, "\"0\"", "0") == "f.json: element 1, term 1: \"bracket\" must be a string (0)");
  CHECK_THAT(
      message_of(valid, "\"0\"", "\"[0,1\""),
      Catch::Matchers::StartsWith("f.json: element 1, term 1: a bracket is a letter or [bracket,bracket]"));
  CHECK_THAT(message_of(valid, "\"degree\": 1", "\"degree\": 2"),
             Catch::Matchers::Contains("word \"1 1\" is 0, expected 0.5"));
}
