#pragma once
/// Bounds for statistical tests, as inequalities rather than quantiles, so that a false-alarm rate is a
/// bound.
#include <cmath>
#include <cstddef>
#include <span>

namespace wienertree_test {

inline constexpr double false_alarm = 1e-7;  ///< of each test case, over all its comparisons together

/// |Z| exceeds this with probability below false_alarm / comparisons, Z standard normal:
/// P(|Z| > z) <= exp(-z^2/2).
inline double normal_bound(double comparisons) { return std::sqrt(2 * std::log(comparisons / false_alarm)); }

/// Bernstein: the mean of R independent variables of variance v, each a sum of independent variables that
/// stay within 1 of their means (or one such), is further than this from its expectation with probability
/// below false_alarm / comparisons: P(|mean - mu| > sqrt(2 v L / R) + 2 L / (3 R)) <= 2 exp(-L).
inline double bernstein_bound(double variance, double draws, double comparisons) {
  const double L = std::log(2 * comparisons / false_alarm);
  return std::sqrt(2 * variance * L / draws) + 2 * L / (3 * draws);
}

/// A chi-square variable with k degrees of freedom exceeds this with probability below
/// false_alarm / comparisons (Laurent, Massart 2000, Ann. Statist. 28, lemma 1).
inline double chi_square_bound(double k, double comparisons) {
  const double L = std::log(comparisons / false_alarm);
  return k + 2 * std::sqrt(k * L) + 2 * L;
}

/// Pearson's statistic for observed counts against expected ones (all positive).
inline double chi_square(std::span<const double> observed, std::span<const double> expected) {
  double x = 0;
  for (std::size_t i = 0; i < observed.size(); ++i)
    x += (observed[i] - expected[i]) * (observed[i] - expected[i]) / expected[i];
  return x;
}

/// Slope of the least-squares line through (x, y).
inline double slope(std::span<const double> x, std::span<const double> y) {
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (std::size_t i = 0; i < x.size(); ++i) mx += x[i], my += y[i];
  mx /= static_cast<double>(x.size());
  my /= static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mx) * (y[i] - my);
    xx += (x[i] - mx) * (x[i] - mx);
  }
  return xy / xx;
}

}  // namespace wienertree_test
