#include "wienertree/study/wasserstein.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

using namespace wienertree;

namespace {

// One component; variances empty: Dirac masses.
struct Law {
  Batch points, variances;
  std::vector<double> weight;
  Law(std::vector<double> x, std::vector<double> w, std::vector<double> v = {})
      : points(1, x.size()), variances(v.empty() ? 0 : 1, v.size()), weight(std::move(w)) {
    for (std::size_t n = 0; n < x.size(); ++n) points(0, n) = x[n];
    for (std::size_t n = 0; n < v.size(); ++n) variances(0, n) = v[n];
  }
  Posterior posterior() const {
    Posterior p;
    p.points = points;
    p.covariance = variances;
    p.weight = weight;
    return p;
  }
};

double distance(const Law& a, const Law& b) { return wasserstein(a.posterior(), b.posterior(), 0); }

// E|m + s Z|, the distance of N(m, s^2) from the mass at 0.
double absolute_moment(double m, double s) {
  return s * std::sqrt(2 / std::numbers::pi) * std::exp(-m * m / (2 * s * s)) +
         m * std::erf(m / (s * std::numbers::sqrt2));
}

}  // namespace

TEST_CASE("W_1 of equally many equal masses is the mean distance of the sorted points") {
  // sum of 200 terms of size about 1, each rounded: 1e-13 is a thousand roundings.
  std::mt19937_64 engine(7);
  std::normal_distribution<double> normal;
  std::vector<double> x(200), y(200);
  for (double& v : x) v = normal(engine);
  for (double& v : y) v = 0.3 + 1.4 * normal(engine);
  const Law a(x, std::vector(200, 1 / 200.0)), b(y, std::vector(200, 1 / 200.0));
  std::sort(x.begin(), x.end());
  std::sort(y.begin(), y.end());
  double mean = 0;
  for (std::size_t i = 0; i < 200; ++i) mean += std::fabs(x[i] - y[i]) / 200;
  CHECK(distance(a, b) == Approx(mean).epsilon(1e-13));
  CHECK(distance(b, a) == Approx(mean).epsilon(1e-13));
  CHECK(distance(a, a) == Approx(0).margin(1e-13));
}

TEST_CASE("W_1 of a Gaussian from a mass is the absolute moment") {
  // Exact but for rounding and the mass beyond nine standard deviations, 1e-19.
  for (const double m : {0.0, 0.7, -3.0})
    for (const double s : {0.01, 1.0, 20.0})
      CHECK(distance(Law({0.0}, {1.0}), Law({m}, {1.0}, {s * s})) ==
            Approx(absolute_moment(m, s)).epsilon(1e-12));
}

TEST_CASE("W_1 of Gaussians: a shift is its length, a scale its difference times E|Z|") {
  CHECK(distance(Law({1.0}, {1.0}, {4.0}), Law({1.25}, {1.0}, {4.0})) == Approx(0.25).epsilon(1e-12));
  CHECK(distance(Law({1.0}, {1.0}, {4.0}), Law({1.0}, {1.0}, {9.0})) ==
        Approx(std::sqrt(2 / std::numbers::pi)).epsilon(1e-12));
}

TEST_CASE("W_1 of mixtures moved along a line is the mean of the moves") {
  // Both components move the same way, so that the distribution functions do not cross: W_1 is the difference
  // of the means.
  const Law a({-2.0, 1.0}, {0.3, 0.7}, {0.5, 2.0}), b({-1.0, 1.5}, {0.3, 0.7}, {0.5, 2.0});
  CHECK(distance(a, b) == Approx(0.3 * 1 + 0.7 * 0.5).epsilon(1e-12));
}

TEST_CASE("W_1 of a Gaussian's quantiles from it falls as the number of nodes grows") {
  // Masses 1/N at the quantiles of (n - 1/2)/N: W_1 is of order 1/N up to a logarithm, and its value at N is
  // an integral that the sum over the cells approximates; here: between half and twice 1/N times the mean of
  // |q'| over the bulk.
  double before = 1;
  for (const std::size_t N : {10, 100, 1000}) {
    std::vector<double> x;
    for (std::size_t n = 0; n < N; ++n) {
      const double level = (static_cast<double>(n) + 0.5) / static_cast<double>(N);
      double low = -10, high = 10;
      for (int i = 0; i < 80; ++i) {
        const double middle = (low + high) / 2;
        (0.5 * std::erfc(-middle / std::numbers::sqrt2) < level ? low : high) = middle;
      }
      x.push_back(low);
    }
    const double d = distance(Law(x, std::vector(N, 1 / static_cast<double>(N))), Law({0.0}, {1.0}, {1.0}));
    CHECK(d < before / 5);
    before = d;
  }
}
