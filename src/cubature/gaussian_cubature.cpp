#include "wienertree/cubature/gaussian_cubature.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

using Eigen::Index;

GaussianCubature with_origin(double weight_of_origin, const Eigen::MatrixXd& others, std::string source) {
  GaussianCubature rule;
  rule.points = Eigen::MatrixXd::Zero(others.rows(), others.cols() + 1);
  rule.points.rightCols(others.cols()) = others;
  rule.weights = Eigen::VectorXd::Constant(others.cols() + 1,
                                           (1 - weight_of_origin) / static_cast<double>(others.cols()));
  rule.weights[0] = weight_of_origin;
  rule.source = std::move(source);
  return rule;
}

GaussianCubature gauss_hermite() {
  Eigen::MatrixXd points(1, 2);
  points << std::sqrt(3.0), -std::sqrt(3.0);
  return with_origin(2.0 / 3.0, points, "Gauss-Hermite, 3 points");
}

GaussianCubature radon() {
  const double h = std::sqrt(3.0);
  Eigen::MatrixXd points(2, 6);
  points << 2, 1, -1, -2, -1, 1,  //
      0, h, h, 0, -h, -h;
  return with_origin(0.5, points, "Radon's hexagon, 7 points");
}

GaussianCubature icosahedron() {
  // (0, +-a, +-b) and its cyclic permutations, b/a the golden ratio, a^2 + b^2 = 5.
  const double golden = (1 + std::sqrt(5.0)) / 2;
  const double a = std::sqrt(5 / (1 + golden * golden)), b = golden * a;
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(3, 12);
  Index k = 0;
  for (int i = 0; i < 3; ++i) {
    for (const double x : {a, -a}) {
      for (const double y : {b, -b}) {
        points((i + 1) % 3, k) = x;
        points((i + 2) % 3, k++) = y;
      }
    }
  }
  return with_origin(0.4, points, "icosahedron, 13 points");
}

GaussianCubature pairs_in_dimension_4() {
  const double s = std::sqrt(3.0);
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(4, 24);
  Index k = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      for (const double x : {s, -s}) {
        for (const double y : {s, -s}) {
          points(i, k) = x;
          points(j, k++) = y;
        }
      }
    }
  }
  return with_origin(1.0 / 3.0, points, "Stroud, Secrest (1963), 2p^2+1 points");
}

// The Kerdock code of length 16 (Nordstrom, Robinson 1967): the words (Tr((a x)^3) + Tr(b x) + e (Tr(a x) +
// beta) + c) at the 16 places (x, e) in GF(8) x GF(2), for a, b in GF(8), beta, c in GF(2). Its dual distance
// is 6, so that its 256 words are an orthogonal array of strength 5. GF(8) is GF(2)[X]/(X^3 + X + 1).
unsigned multiply_in_gf8(unsigned x, unsigned y) {
  unsigned product = 0;
  for (int bit = 0; bit < 3; ++bit) {
    if ((y >> bit) & 1U) product ^= x << bit;
  }
  if (product & 16U) product ^= 0b10110U;
  if (product & 8U) product ^= 0b1011U;
  return product;
}

// Tr(x) = x + x^2 + x^4, which is the coefficient of 1 for this modulus (Tr 1 = 1, Tr X = Tr X^2 = 0).
unsigned trace_of_gf8(unsigned x) { return x & 1U; }

std::vector<unsigned> nordstrom_robinson_words() {
  std::vector<unsigned> words;
  for (unsigned a = 0; a < 8; ++a) {
    for (unsigned b = 0; b < 8; ++b) {
      for (unsigned rest = 0; rest < 4; ++rest) {
        unsigned word = 0;
        for (unsigned place = 0; place < 16; ++place) {
          const unsigned x = place & 7U, e = place >> 3U, ax = multiply_in_gf8(a, x);
          const unsigned cube = multiply_in_gf8(ax, multiply_in_gf8(ax, ax));
          const unsigned bit = trace_of_gf8(cube) ^ trace_of_gf8(multiply_in_gf8(b, x)) ^
                               (e & (trace_of_gf8(ax) ^ (rest & 1U))) ^ (rest >> 1U);
          word |= bit << place;
        }
        words.push_back(word);
      }
    }
  }
  return words;
}

// Rows of an orthogonal array of strength 5 with p two-level columns, as bits.
std::vector<unsigned> orthogonal_array(int p) {
  if (p > 8) return nordstrom_robinson_words();
  std::vector<unsigned> rows;
  for (unsigned row = 0; row < (1U << p); ++row) {
    if (p <= 5 || std::popcount(row) % 2 == 0) rows.push_back(row);
  }
  return rows;
}

GaussianCubature axes_and_orthogonal_array(int p) {
  const std::vector<unsigned> rows = orthogonal_array(p);
  const double r2 = (p + 2) / 2.0, s2 = (p + 2.0) / (p - 2.0);
  const auto n = static_cast<Index>(rows.size());
  const Index axes = Index{2} * p;
  GaussianCubature rule;
  rule.source =
      fmt::format("Stroud (1971), E_n^r2 5-3, over an orthogonal array (Victoir 2004), {} points", axes + n);
  rule.points = Eigen::MatrixXd::Zero(p, axes + n);
  for (Index k = 0; k < axes; ++k) rule.points(k / 2, k) = k % 2 == 0 ? std::sqrt(r2) : -std::sqrt(r2);
  for (Index k = 0; k < n; ++k) {
    for (int i = 0; i < p; ++i) {
      const bool up = (rows[static_cast<std::size_t>(k)] >> i) & 1U;
      rule.points(i, axes + k) = up ? std::sqrt(s2) : -std::sqrt(s2);
    }
  }
  rule.weights.resize(axes + n);
  rule.weights.head(axes).setConstant(1 / (r2 * r2));
  rule.weights.tail(n).setConstant(1 / (s2 * s2 * static_cast<double>(n)));
  return rule;
}

// Visits the monomials z_{i_1} .. z_{i_k}, i_1 <= .. <= i_k, k <= degree; `values` is the monomial at each
// point.
double max_error_from(const GaussianCubature& rule, int degree, Index last, const std::vector<int>& exponents,
                      const Eigen::ArrayXd& values) {
  double expected = 1;
  for (const int exponent : exponents) {
    for (int k = exponent - 1; k > 1; k -= 2) expected *= k;
    if (exponent % 2 == 1) expected = 0;
  }
  double error = std::abs((rule.weights.array() * values).sum() - expected);
  if (degree == 0) return error;
  for (Index i = last; i < rule.points.rows(); ++i) {
    std::vector<int> next = exponents;
    ++next[static_cast<std::size_t>(i)];
    error = std::max(
        error, max_error_from(rule, degree - 1, i, next, values * rule.points.row(i).transpose().array()));
  }
  return error;
}

}  // namespace

GaussianCubature gaussian_cubature_5(int p) {
  if (p < 1 || p > gaussian_cubature_5_max_dimension)
    throw InputError(
        fmt::format("a Gaussian rule of degree 5 with positive weights is provided for dimensions 1 to {}",
                    gaussian_cubature_5_max_dimension),
        "gaussian_cubature_5", fmt::format("{}", p));
  switch (p) {
    case 1:
      return gauss_hermite();
    case 2:
      return radon();
    case 3:
      return icosahedron();
    case 4:
      return pairs_in_dimension_4();
    default:
      return axes_and_orthogonal_array(p);
  }
}

double max_monomial_error(const GaussianCubature& rule, int degree) {
  return max_error_from(rule, degree, 0, std::vector<int>(static_cast<std::size_t>(rule.points.rows()), 0),
                        Eigen::ArrayXd::Ones(rule.points.cols()));
}

void require_degree_5(const GaussianCubature& rule) {
  if ((rule.weights.array() <= 0).any())
    throw InputError("a Gaussian rule needs positive weights", rule.source,
                     fmt::format("{}", rule.weights.minCoeff()));
  if (const double error = max_monomial_error(rule, 5); !(error <= 1e-12))
    throw InputError("the Gaussian rule is not of degree 5: a monomial is off", rule.source,
                     fmt::format("{}", error));
}

}  // namespace wienertree
