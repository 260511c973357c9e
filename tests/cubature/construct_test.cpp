#include "wienertree/cubature/construct.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/cubature/verification.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;

namespace {

CubatureFormula shipped(const std::string& name) {
  return load_formula(std::string(WIENERTREE_SOURCE_DIR) + "/data/cubature_formulas/" + name + ".json");
}

// Whether each path of a is one of b, weights included, up to rounding in the file's digits.
bool same_paths(const CubatureFormula& a, const CubatureFormula& b) {
  const auto close = [](const CubaturePath& u, const CubaturePath& v) {
    return std::abs(u.weight - v.weight) < 1e-15 && u.increments.cols() == v.increments.cols() &&
           (u.increments - v.increments).lpNorm<Eigen::Infinity>() < 1e-14;
  };
  return a.paths.size() == b.paths.size() &&
         std::all_of(a.paths.begin(), a.paths.end(), [&](const CubaturePath& path) {
           return std::any_of(b.paths.begin(), b.paths.end(),
                              [&](const auto& other) { return close(path, other); });
         });
}

}  // namespace

TEST_CASE("Constructed formulas have exactly their degree, for every dimension") {
  for (int p = 1; p <= 6; ++p) {
    for (const int degree : {3, 5}) {
      const CubatureFormula formula = construct(degree, p);
      const FormulaVerification verification = verify(formula);
      INFO(formula.name << ": " << verification.brief());
      CHECK(formula.dimension == p);
      CHECK(verification.max_error < 1e-14);
      CHECK(verification.degree == degree);
    }
  }
}

TEST_CASE("Degree 5 is constructed in ten dimensions, verified") {
  const CubatureFormula formula = construct(5, 10);
  CHECK(verify(formula, moment_tolerance, false).max_error < 1e-14);
}

TEST_CASE("Degree 3 takes 2p straight paths") {
  const CubatureFormula formula = construct_degree_3(3);
  REQUIRE(formula.paths.size() == 6);
  for (const CubaturePath& path : formula.paths) {
    CHECK(path.weight == Approx(1.0 / 6));
    CHECK(path.increments.col(0).tail(3).norm() == Approx(std::sqrt(3.0)));
    CHECK(path.increments(0, 0) == 1);
  }
}

TEST_CASE("Closed forms agree with the files of the same name") {
  CHECK(same_paths(construct_lyons_victoir_5_1(), shipped("lyons-victoir-5-1")));
  CHECK(same_paths(construct_ninomiya_victoir(2), shipped("ninomiya-victoir-5-2")));
  CHECK(same_paths(construct_ninomiya_victoir(3), shipped("ninomiya-victoir-5-3")));
  CHECK(same_paths(construct_ninomiya_victoir(4), shipped("ninomiya-victoir-5-4")));
}

TEST_CASE("Splitting paths merge where the order does not matter") {
  const CubatureFormula formula = construct_ninomiya_victoir(2);
  CHECK(formula.paths.size() == 11);  // 0, two points on an axis, four others twice
  CHECK(total_segments(formula) == 39);
  CHECK(formula.paths[0].increments.cols() == 1);
}

TEST_CASE("Gaussian rules have positive weights and all monomials to degree 5") {
  for (int p = 1; p <= gaussian_cubature_5_max_dimension; ++p) {
    const GaussianCubature rule = gaussian_cubature_5(p);
    INFO(p << ": " << rule.source);
    CHECK(rule.points.rows() == p);
    CHECK((rule.weights.array() > 0).all());
    // Monomials sum up to 288 terms of size at most r^4 < 100 with weights summing to 1: rounding below
    // 1e-13.
    CHECK(max_monomial_error(rule, 5) < 1e-13);
    CHECK(max_monomial_error(rule, 6) > 0.1);
  }
}

TEST_CASE("The error of a rule is found by its monomials") {
  // +-sqrt 2 e_i in the plane: degree 3; at degree 4 E x^4 = 2 instead of 3 and E x^2 y^2 = 0 instead of 1.
  const double r = std::sqrt(2.0);
  GaussianCubature rule{Eigen::MatrixXd(2, 4), Eigen::VectorXd::Constant(4, 0.25), "cross"};
  rule.points << r, -r, 0, 0, 0, 0, r, -r;
  CHECK(max_monomial_error(rule, 3) < 1e-15);
  CHECK(max_monomial_error(rule, 4) == Approx(1.0));
  CHECK_THROWS_AS(construct_ninomiya_victoir(rule), InputError);
}

TEST_CASE("A rule with a negative weight is refused") {
  GaussianCubature rule = gaussian_cubature_5(1);
  rule.points.conservativeResize(1, 5);
  rule.points(0, 3) = rule.points(0, 4) = 1;
  rule.weights.conservativeResize(5);
  rule.weights[3] = 0.1;
  rule.weights[4] = -0.1;
  CHECK_THROWS_AS(construct_ninomiya_victoir(rule), InputError);
}

TEST_CASE("What cannot be constructed is refused") {
  CHECK_THROWS_AS(construct(7, 1), InputError);
  CHECK_THROWS_AS(construct(4, 1), InputError);
  CHECK_THROWS_AS(construct(5, 0), InputError);
  CHECK_THROWS_AS(construct(3, 0), InputError);
  CHECK_THROWS_AS(construct(3, -2), InputError);
  CHECK_THROWS_AS(construct(5, gaussian_cubature_5_max_dimension + 1), InputError);
  CHECK_THROWS_AS(construct(3, 500), InputError);  // too many words to verify
}
