#include "wienertree/study/slope.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "wienertree/numeric/error.hpp"

using namespace wienertree;

TEST_CASE("points on a line give its slope and no width") {
  const std::vector<double> x = {10, 20, 40, 80, 160};
  std::vector<double> y;
  for (const double v : x) y.push_back(3 * std::pow(v, -2));
  const SlopeFit fit = fit_slope(x, y);
  // Sums of five logarithms of size 5: 1e-12 is ample.
  CHECK(fit.slope == Approx(-2).epsilon(1e-12));
  CHECK(fit.at(10) == Approx(0.03).epsilon(1e-12));
  CHECK(fit.slope_high - fit.slope_low == Approx(0).margin(1e-6));
  CHECK(fit.band(40) == Approx(1).margin(1e-6));
}

TEST_CASE("the interval of a slope is that of textbooks") {
  // Longley's kind of example, small: log x = 0, 1, 2, 3; log y = 1, 3, 2, 5. Slope 1.1, residual
  // variance 2.7/2, sum of squares 5, Student's quantile for two degrees of freedom 4.30265.
  std::vector<double> x, y;
  for (const double v : {0, 1, 2, 3}) x.push_back(std::exp(v));
  for (const double v : {1, 3, 2, 5}) y.push_back(std::exp(v));
  const SlopeFit fit = fit_slope(x, y);
  CHECK(fit.slope == Approx(1.1).epsilon(1e-12));
  CHECK(fit.intercept == Approx(1.1).epsilon(1e-12));
  const double half = 4.302652729911275 * std::sqrt(2.7 / 2 / 5);
  CHECK(fit.slope_high == Approx(1.1 + half).epsilon(1e-9));
  CHECK(fit.slope_low == Approx(1.1 - half).epsilon(1e-9));
  CHECK(fit.band(std::exp(1.5)) ==
        Approx(std::exp(4.302652729911275 * std::sqrt(2.7 / 2 / 4))).epsilon(1e-9));
}

TEST_CASE("two points have a slope and no interval") {
  const SlopeFit fit = fit_slope(std::vector<double>{1, 2}, std::vector<double>{1, 0.25});
  CHECK(fit.slope == Approx(-2).epsilon(1e-12));
  CHECK(std::isnan(fit.slope_low));
  CHECK(std::isnan(fit.band(1)));
}

TEST_CASE("the interval covers the slope as often as it says") {
  // Null hypothesis: coverage is 95 %. 4000 draws of five points with Gaussian errors; the number of misses
  // is binomial with mean 200 and standard deviation 13.8, and 5 of these are exceeded either way with
  // probability 6e-7.
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal;
  const std::vector<double> x = {1, 2, 4, 8, 16};
  int misses = 0;
  for (int draw = 0; draw < 4000; ++draw) {
    std::vector<double> y;
    for (const double v : x) y.push_back(std::pow(v, -1.5) * std::exp(0.2 * normal(engine)));
    const SlopeFit fit = fit_slope(x, y);
    misses += fit.slope_low > -1.5 || fit.slope_high < -1.5;
  }
  CHECK(std::abs(misses - 200) < 5 * 13.8);
}

TEST_CASE("what has no slope is refused") {
  const std::vector<double> one = {1}, two = {1, 2}, equal = {2, 2}, zero = {1, 0};
  CHECK_THROWS_AS(fit_slope(one, one), InputError);
  CHECK_THROWS_AS(fit_slope(equal, two), InputError);
  CHECK_THROWS_AS(fit_slope(two, zero), InputError);
}
