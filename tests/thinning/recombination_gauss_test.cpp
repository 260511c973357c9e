/// Gauss quadrature of discrete measures.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <numeric>

#include "wienertree/numeric/random.hpp"
#include "wienertree/thinning/recombination/gauss.hpp"

using namespace wienertree;
using recombination::DiscreteGauss;

namespace {

struct Line {
  std::vector<double> z, w;
};

// P_0(z) .. P_degree(z)
std::vector<long double> legendre(double z, std::size_t degree) {
  std::vector<long double> p{1, z};
  for (std::size_t k = 1; k < degree; ++k) {
    const auto n = static_cast<long double>(k);
    p.push_back(((2 * n + 1) * z * p[k] - n * p[k - 1]) / (n + 1));
  }
  p.resize(degree + 1);
  return p;
}

std::vector<double> integrals(std::span<const double> z, std::span<const double> w, std::size_t degree) {
  std::vector<long double> sum(degree + 1);
  long double total = 0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    const auto p = legendre(z[i], degree);
    for (std::size_t k = 0; k <= degree; ++k) sum[k] += w[i] * p[k];
    total += w[i];
  }
  for (auto& s : sum) s /= total;
  return {sum.begin(), sum.end()};
}

Line random_line(std::size_t n, std::uint64_t seed, double depth) {
  Line line{std::vector<double>(n), std::vector<double>(n)};
  const RandomStream random{seed};
  random.uniforms(0, line.z);
  random.uniforms(n + 1, line.w);
  for (double& z : line.z) z = 2 * z - 1;
  for (double& w : line.w) w = std::exp(-depth * w);
  return line;
}

void check_quadrature(const Line& line, std::size_t s) {
  DiscreteGauss gauss;
  const std::size_t count = gauss.compute(line.z, line.w, s);
  REQUIRE(count >= 1);
  REQUIRE(count <= s);
  const auto [low, high] = std::minmax_element(line.z.begin(), line.z.end());
  for (std::size_t j = 0; j < count; ++j) {
    REQUIRE(gauss.weights()[j] >= 0);
    REQUIRE((gauss.nodes()[j] >= *low && gauss.nodes()[j] <= *high));
    if (j > 0) REQUIRE(gauss.nodes()[j] >= gauss.nodes()[j - 1]);
  }
  const auto before = integrals(line.z, line.w, 2 * s),
             after = integrals(gauss.nodes(), gauss.weights(), 2 * s);
  for (std::size_t k = 0; k < 2 * s; ++k) {
    CAPTURE(line.z.size(), s, k);
    // P_k' <= k^2 carries a node's rounding into the integral: 2s - 1 < 32, 32^2 x 1e-16 x a few.
    REQUIRE(std::abs(after[k] - before[k]) < 1e-12);
  }
  // z^{2s} is P_{2s} over its leading coefficient (4s)! / (2^{2s} (2s)!^2) and lower degrees, which are kept.
  double leading = 1;
  for (std::size_t k = 0; k < 2 * s; ++k)
    leading *= static_cast<double>(2 * k + 1) / static_cast<double>(k + 1);
  REQUIRE(std::abs(before[2 * s] - after[2 * s] - leading * gauss.first_change()) < 1e-12);
}

}  // namespace

TEST_CASE("Gauss quadrature of a fine Legendre rule is the Gauss-Legendre rule") {
  // The midpoint rule in the angle, z = cos t with weight sin t, is not exact; Gauss' own 40 nodes are: of a
  // discrete measure that integrates degree 79 like dz, any coarser Gauss rule is that of dz.
  Line grid;
  for (std::size_t i = 0; i < 40; ++i) {
    double z = std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / 40.5);
    double derivative = 1;
    for (int iteration = 0; iteration < 20; ++iteration) {
      const auto p = legendre(z, 40);
      derivative = static_cast<double>(40 * (z * p[40] - p[39]) / (z * z - 1));
      z -= static_cast<double>(p[40]) / derivative;
    }
    grid.z.push_back(z);
    grid.w.push_back(2 / ((1 - z * z) * derivative * derivative));
  }
  DiscreteGauss gauss;
  REQUIRE(gauss.compute(grid.z, grid.w, 5) == 5);
  const double node[] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831, 0.9061798459386640};
  const double weight[] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                           0.2369268850561891};
  for (std::size_t j = 0; j < 5; ++j) {
    REQUIRE(gauss.nodes()[j] == Approx(node[j]).epsilon(0).margin(1e-14));
    REQUIRE(gauss.weights()[j] == Approx(weight[j] / 2).epsilon(1e-13));
  }
}

TEST_CASE("Gauss quadrature of a sampled normal density is the Gauss-Hermite rule") {
  // The trapezoidal rule of step 1/8 integrates a polynomial times the normal density to exp(-(2 pi 8)^2 / 2).
  Line grid;
  for (int i = -96; i <= 96; ++i) {
    grid.z.push_back(i / 96.0);
    grid.w.push_back(std::exp(-0.5 * (i / 8.0) * (i / 8.0)));
  }
  DiscreteGauss gauss;
  REQUIRE(gauss.compute(grid.z, grid.w, 5) == 5);
  const double node[] = {-2.856970013872806, -1.355626179974266, 0, 1.355626179974266, 2.856970013872806};
  const double weight[] = {0.01125741132772069, 0.2220759220056126, 0.5333333333333333, 0.2220759220056126,
                           0.01125741132772069};
  for (std::size_t j = 0; j < 5; ++j) {
    REQUIRE(12 * gauss.nodes()[j] == Approx(node[j]).epsilon(0).margin(1e-13));
    REQUIRE(gauss.weights()[j] == Approx(weight[j]).epsilon(1e-12));
  }
}

TEST_CASE("Gauss quadrature keeps the moments to degree 2s - 1 and says what changes next") {
  for (const double depth : {0.0, 5.0, 50.0, 690.0})
    for (std::size_t s = 1; s <= 16; ++s)
      for (const std::size_t n : {s + 1, 2 * s + 3, 200 + s})
        check_quadrature(random_line(n, 7 * s + n, depth), s);
}

TEST_CASE("Gauss quadrature of few or nearly coinciding points") {
  DiscreteGauss gauss;
  SECTION("one point") {
    REQUIRE(gauss.compute(std::vector{0.25}, std::vector{3.0}, 4) == 1);
    REQUIRE(gauss.nodes()[0] == 0.25);
    REQUIRE(gauss.weights()[0] == 1);
    REQUIRE(gauss.first_change() == 0);
  }
  SECTION("all points equal") {
    REQUIRE(gauss.compute(std::vector(9, -0.5), std::vector(9, 1e-200), 4) == 1);
    REQUIRE(gauss.nodes()[0] == -0.5);
  }
  SECTION("three distinct points, many times") {
    Line line;
    for (int i = 0; i < 30; ++i) {
      line.z.push_back(i % 3 - 1);
      line.w.push_back(1 + i);
    }
    REQUIRE(gauss.compute(line.z, line.w, 8) == 3);
    REQUIRE(gauss.nodes()[0] == Approx(-1).epsilon(0).margin(1e-14));
    REQUIRE(gauss.nodes()[1] == Approx(0).epsilon(0).margin(1e-14));
    REQUIRE(gauss.nodes()[2] == Approx(1).epsilon(0).margin(1e-14));
    check_quadrature(line, 8);
  }
  SECTION("clusters of width 1e-13, 1e-10, 1e-6") {
    for (const double width : {1e-13, 1e-10, 1e-6}) {
      Line line;
      for (int i = 0; i < 40; ++i) {
        line.z.push_back((i % 4) * 0.6 - 0.9 + width * i / 40);
        line.w.push_back(1.0 + i % 7);
      }
      for (const std::size_t s : {3, 4, 5, 8, 12}) check_quadrature(line, s);
    }
  }
}
