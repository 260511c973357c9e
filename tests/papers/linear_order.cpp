// Order of convergence of every formula on linear SDEs.
//
// Claim (Kusuoka 2001; Lyons, Victoir 2004): n steps of a formula of degree m leave an error O(n^{-(m-1)/2}).
// Problem: dX = A_0 X dt + sum_i A_i X o dB^i on R^4, A_i random and not commuting. Then
//     E X_1 = exp(A_0 + 1/2 sum_i A_i^2) X_0
// exactly, and a step of length s is the matrix
//     K_s = sum_j lambda_j prod_segments exp(sum_k D_k A_k),
// so that the error |K_{1/n}^n - exp(..)| / |exp(..)| (Frobenius norms) is computed without any other
// approximation.
//
// Entries of the A_i are Gaussian, each A_i scaled to Frobenius norm 1; errors are root mean squares over 8
// draws, so that a chance cancellation in one draw does not show as order. The order is the least-squares
// slope of log2(error) over n = 2, 4, 8: at n = 1 terms of higher order still count (up to 0.1 in the slope),
// and at n = 8 the smallest error (2e-11, degree 11) is a thousand times above rounding (some 1e-15 a step).
// Criterion: slope within 0.15 of (m-1)/2.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/lie_formula.hpp"

using namespace wienertree;
using Matrix = Eigen::Matrix4d;

namespace {

constexpr int draws = 8;
constexpr std::array<int, 4> steps{1, 2, 4, 8};
using Errors = std::array<double, steps.size()>;

std::vector<Matrix> random_fields(int p, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  std::vector<Matrix> A(static_cast<std::size_t>(p) + 1);
  for (Matrix& a : A) {
    for (double& entry : a.reshaped()) entry = normal(engine);
    a /= a.norm();
  }
  return A;
}

Matrix step_matrix(const CubatureFormula& formula, const std::vector<Matrix>& A, double s) {
  Matrix K = Matrix::Zero();
  std::vector<double> D(A.size());
  for (const CubaturePath& path : formula.paths) {
    Matrix flow = Matrix::Identity();
    for (Eigen::Index k = 0; k < path.increments.cols(); ++k) {
      scaled_increments(path, static_cast<std::size_t>(k), s, D);
      Matrix field = Matrix::Zero();
      for (std::size_t i = 0; i < A.size(); ++i) field += D[i] * A[i];
      flow = field.exp() * flow;
    }
    K += path.weight * flow;
  }
  return K;
}

// The bracket of the linear fields x -> A x, x -> B x is the linear field of
// (DV_B) V_A - (DV_A) V_B = BA - AB.
Matrix field_of(const LieBracket& bracket, const std::vector<Matrix>& A) {
  if (bracket.is_letter()) return A[static_cast<std::size_t>(bracket.letter())];
  const Matrix left = field_of(bracket.left(), A), right = field_of(bracket.right(), A);
  return right * left - left * right;
}

Matrix step_matrix(const LieFormula& formula, const std::vector<Matrix>& A, double s) {
  Matrix K = Matrix::Zero();
  for (const LieElement& element : formula.elements) {
    Matrix field = Matrix::Zero();
    for (const LieTerm& term : element.terms)
      field += std::pow(s, term.bracket.degree() / 2.0) * term.coefficient * field_of(term.bracket, A);
    K += element.weight * field.exp();
  }
  return K;
}

Errors relative_errors(const auto& formula) {
  std::mt19937_64 engine(1);
  Errors squares{};
  for (int draw = 0; draw < draws; ++draw) {
    const std::vector<Matrix> A = random_fields(formula.dimension, engine);
    Matrix generator = A[0];
    for (std::size_t i = 1; i < A.size(); ++i) generator += 0.5 * A[i] * A[i];
    const Matrix exact = generator.exp();
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Matrix K = step_matrix(formula, A, 1.0 / steps[k]);
      Matrix power = Matrix::Identity();
      for (int step = 0; step < steps[k]; ++step) power = K * power;
      squares[k] += (power - exact).squaredNorm() / exact.squaredNorm() / draws;
    }
  }
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

// Over n = 2, 4, 8 the least-squares slope of log2(error) against log2(n) is half the difference of the ends.
double order(const Errors& errors) { return std::log2(errors[1] / errors[3]) / 2; }

std::size_t nodes(const CubatureFormula& formula) { return formula.paths.size(); }
std::size_t nodes(const LieFormula& formula) { return formula.elements.size(); }
std::size_t flows(const CubatureFormula& formula) { return total_segments(formula); }
std::size_t flows(const LieFormula& formula) { return formula.elements.size(); }

void check_order(const auto& formula) {
  const Errors e = relative_errors(formula);
  std::printf("%-28s %2d %d %4zu %5zu %9.3g  %.2e %.2e %.2e %.2e  %.3f\n", formula.name.c_str(),
              formula.degree, formula.dimension, nodes(formula), flows(formula),
              *verify(formula).next_residual, e[0], e[1], e[2], e[3], order(e));
  INFO(formula.name);
  CHECK(order(e) == Approx((formula.degree - 1) / 2.0).margin(0.15));
}

}  // namespace

TEST_CASE("Errors on linear SDEs fall with order (m-1)/2 for every formula") {
  std::printf("%-28s %2s %s %4s %5s %9s  %s\n", "formula", "m", "p", "path", "segm.", "residual",
              "error at n = 1, 2, 4, 8, order");
  for (const CatalogueEntry& entry : bundled_formulas(WIENERTREE_SOURCE_DIR "/data/cubature_formulas"))
    check_order(entry.formula);
  for (int p = 1; p <= 4; ++p) check_order(construct(3, p));
  for (const int p : {1, 5, 6}) check_order(construct_ninomiya_victoir(p));
  for (int p = 1; p <= 4; ++p) check_order(construct_lie_5(p));
}
