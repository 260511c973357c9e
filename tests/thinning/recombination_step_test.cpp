/// One Caratheodory step against its definition, full rank and not; the basis and its Taylor weights.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/numeric/random.hpp"
#include "wienertree/thinning/recombination/caratheodory.hpp"
#include "wienertree/thinning/recombination/polynomials.hpp"
#include "wienertree/thinning/recombination/step.hpp"

using namespace wienertree;
using namespace wienertree::recombination;

namespace {

// `size` functions of n points of dimension d in [-1,1]^d: the Legendre products of degree <= r and r + 1.
struct Problem {
  std::size_t n, kept, size;
  std::vector<double> moments, weight;
};

template <class Point>
Problem problem(std::size_t d, int degree, std::size_t n, std::uint64_t seed, Point point) {
  const PolynomialBasis basis(d, degree);
  Problem p{n, basis.kept(), basis.size(), std::vector<double>(basis.size() * padded(n)),
            std::vector<double>(n)};
  const RandomStream random{seed};
  std::vector<double> scratch(basis.scratch_size()), value(basis.size() * PolynomialBasis::block), z(d),
      uniform(d);
  for (std::size_t j = 0; j < n; ++j) {
    random.uniforms(j * d, uniform);
    for (double& u : uniform) u = 2 * u - 1;
    point(uniform, z);
    const double one = 1;
    basis.evaluate(z.data(), 1, &one, 1, scratch.data(), value.data());
    for (std::size_t a = 0; a < p.size; ++a) p.moments[a * padded(n) + j] = value[a * PolynomialBasis::block];
    p.weight[j] = random.uniform((n + 1) * d + j);
  }
  return p;
}

// Reduces, checks what must hold, and returns the number of positive weights.
std::size_t reduce(CaratheodoryStep& step, const Problem& p) {
  std::vector<double> weight = p.weight, discrepancy(p.size - p.kept);
  step.reduce(p.moments.data(), p.n, p.kept, p.size, weight, discrepancy);
  std::size_t positive = 0;
  long double total = 0;
  for (const double w : weight) {
    REQUIRE(w >= 0);
    positive += w > 0;
    total += w;
  }
  for (std::size_t a = 0; a < p.size; ++a) {
    long double change = 0;
    for (std::size_t j = 0; j < p.n; ++j)
      change += p.moments[a * padded(p.n) + j] * (static_cast<long double>(weight[j]) - p.weight[j]);
    if (a >= p.kept) change -= discrepancy[a - p.kept];
    CAPTURE(p.n, p.kept, a);
    // n null vectors, each exact to n epsilon, with steps of the size of the weights.
    REQUIRE(std::abs(change) < 1e-13 * total);
  }
  return positive;
}

const auto anywhere = [](const std::vector<double>& u, std::vector<double>& z) { z = u; };

}  // namespace

TEST_CASE("A step leaves as many points as moments, and the moments") {
  CaratheodoryStep step;
  for (std::size_t d = 1; d <= 4; ++d)
    for (int r = 1; r <= 5; ++r)
      for (const std::size_t extra : {1, 7, 40}) {
        const PolynomialBasis basis(d, r);
        if (basis.kept() > 60) continue;
        REQUIRE(reduce(step, problem(d, r, basis.kept() + extra, d + extra, anywhere)) == basis.kept());
      }
}

TEST_CASE("A step on dependent moments leaves as many points as their rank") {
  CaratheodoryStep step;
  SECTION("on a circle: trigonometric polynomials of degree r, 2 r + 1 of them") {
    const auto circle = [](const std::vector<double>& u, std::vector<double>& z) {
      z = {std::cos(3.1 * u[0]), std::sin(3.1 * u[0])};
    };
    for (int r = 1; r <= 7; ++r)
      REQUIRE(reduce(step, problem(2, r, 60, 5, circle)) == 2 * static_cast<std::size_t>(r) + 1);
  }
  SECTION("on a line in space: r + 1") {
    const auto line = [](const std::vector<double>& u, std::vector<double>& z) {
      z = {u[0], -0.5 * u[0], 0.25 * u[0] + 0.1};
    };
    for (int r = 1; r <= 4; ++r)
      REQUIRE(reduce(step, problem(3, r, 60, 6, line)) == static_cast<std::size_t>(r) + 1);
  }
  SECTION("on five points, each many times: 5") {
    const auto five = [](const std::vector<double>& u, std::vector<double>& z) {
      z = {std::floor(2.4999 * u[0] + 0.5) / 2.5, 0};
      z[1] = z[0] * z[0] - 0.5;
    };
    REQUIRE(reduce(step, problem(2, 5, 80, 7, five)) == 5);
  }
  SECTION("fewer points than moments, none in excess") {
    REQUIRE(reduce(step, problem(3, 3, 12, 8, anywhere)) == 12);
  }
}

TEST_CASE("The further moments change less than they would by chance") {
  // The sign of every step is free. Taken at random the changes of the further moments add up like a random
  // walk; taken to keep them small they must not. Median over 20 seeds of the ratio of the two: about 0.35.
  std::vector<double> steered, unsteered;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Problem p = problem(2, 5, 42, 100 + seed, anywhere);
    CaratheodoryStep step;
    for (const bool steer : {true, false}) {
      std::vector<double> weight = p.weight, e(p.size - p.kept), none;
      if (steer)
        step.reduce(p.moments.data(), p.n, p.kept, p.size, weight, e);
      else
        step.reduce(p.moments.data(), p.n, p.kept, p.kept, weight, none);
      double square = 0;
      for (std::size_t a = p.kept; a < p.size; ++a) {
        double change = 0;
        for (std::size_t j = 0; j < p.n; ++j)
          change += p.moments[a * padded(p.n) + j] * (weight[j] - p.weight[j]);
        square += change * change;
      }
      (steer ? steered : unsteered).push_back(square);
    }
  }
  std::sort(steered.begin(), steered.end());
  std::sort(unsteered.begin(), unsteered.end());
  REQUIRE(steered[10] < 0.5 * unsteered[10]);
}

TEST_CASE("Basis polynomials are products of Legendre polynomials by degree; Taylor weights") {
  const PolynomialBasis basis(2, 2);
  REQUIRE(basis.kept() == 6);
  REQUIRE(basis.size() == 10);
  std::vector<double> scratch(basis.scratch_size()), value(basis.size() * PolynomialBasis::block);
  const double z[] = {0.3, -0.7}, w = 2;
  basis.evaluate(z, 1, &w, 1, scratch.data(), value.data());
  const auto p2 = [](double x) { return (3 * x * x - 1) / 2; };
  const auto p3 = [](double x) { return (5 * x * x * x - 3 * x) / 2; };
  std::vector<double> found,
      expected{
          1,       z[0], z[1], p2(z[0]), z[0] * z[1], p2(z[1]), p3(z[0]), p2(z[0]) * z[1], z[0] * p2(z[1]),
          p3(z[1])};
  for (std::size_t a = 0; a < basis.size(); ++a) found.push_back(value[a * PolynomialBasis::block] / w);
  std::vector<double> weights;
  const double h = 0.5, k = 0.2;
  basis.taylor_weights(std::vector{h, k}, weights);
  // d^a f / a! times the change of x^a, P_3 = 5/2 x^3 + .., P_2 = 3/2 x^2 + ..
  const std::vector<double> expected_weights{h * h * h / 6 / 2.5, h * h * k / 2 / 1.5, h * k * k / 2 / 1.5,
                                             k * k * k / 6 / 2.5};
  for (const auto& [group_first, group_last] :
       {std::pair<std::size_t, std::size_t>{0, 1}, {1, 3}, {3, 6}, {6, 10}})
    for (std::size_t a = group_first; a < group_last; ++a) {
      const auto at = std::find_if(expected.begin(), expected.end(),
                                   [&](double v) { return std::abs(v - found[a]) < 1e-14; });
      const auto position = static_cast<std::size_t>(at - expected.begin());
      REQUIRE((position >= group_first && position < group_last));
      if (a >= 6) REQUIRE(weights[a - 6] == Approx(expected_weights[position - 6]).epsilon(1e-14));
    }
}

// One patch of as many moments as nodes (`--thin levelwise`): the moments are dependent to rounding, and must still
// cost q^3 log2(n/q). The bound: a step on n = 2q points of rank rho takes rho (2q - rho) n operations for the
// factorisation, nu (2 rho + f) n for the nu = n - rho null vectors with f further moments, nu^2 (n + f)/2 for the
// elimination; with f < q/2 that is below 12 q^3 for every rho, and n/q halves at every step but the last.
TEST_CASE("A step costs q^3, also on moments that are dependent to rounding") {
  std::vector<double> per_cube;
  for (const int degree : {8, 12, 16, 22}) {
    const PolynomialBasis basis(2, degree);
    const std::size_t q = basis.kept(), n = 3 * q;
    PatchPoints points;
    points.reserve(2, n);
    points.count = n;
    const RandomStream random{17};
    std::vector<double> z(2 * n);
    random.normals(0, z);
    for (std::size_t j = 0; j < n; ++j) {
      // Nodes of a flow lie close to a curve.
      points.z[j] = std::clamp(z[j] / 4, -1.0, 1.0);
      points.z[n + j] = std::clamp(std::sin(3 * points.z[j]) / 2 + z[n + j] / 400, -1.0, 1.0);
      points.weight[j] = 1.0 / static_cast<double>(n);
      points.label[j] = static_cast<std::uint32_t>(j);
    }
    Caratheodory reduction;
    reduction.reduce(basis, std::vector<double>(basis.size() - q, 1.0), points);
    CHECK(points.count <= q);
    const auto size = static_cast<double>(q);
    per_cube.push_back(reduction.operations() / (size * size * size));
    CHECK(per_cube.back() <= 12 * (1 + std::ceil(std::log2(3.0))));
  }
  CHECK(per_cube.back() <= 1.5 * per_cube.front());
}
