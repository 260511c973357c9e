// The Gauss rule of a square-root process against the moments of its transition.
#include "wienertree/cubature/square_root_rule.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/numeric/error.hpp"

using namespace wienertree;

namespace {

// E v_s^k, k = 0..7, from the cumulants of a noncentral chi-square law.
std::array<long double, 8> moments(const SquareRootProcess& p, double s, double x) {
  const long double growth = std::exp(static_cast<long double>(p.b) * s);
  const long double psi = p.b == 0 ? static_cast<long double>(s) : (growth - 1) / p.b;
  const long double g = p.c * psi / 4, delta = 4 * static_cast<long double>(p.a) / p.c, l = x * growth / g;
  std::array<long double, 8> cumulant{}, m{};
  long double factor = 1, power = 1;
  for (std::size_t j = 1; j < 8; ++j) {
    if (j > 1) factor *= 2 * static_cast<long double>(j - 1);
    power *= g;
    cumulant[j] = factor * (delta + static_cast<long double>(j) * l) * power;
  }
  m[0] = 1;
  for (std::size_t k = 1; k < 8; ++k) {
    long double binomial = 1;
    for (std::size_t j = 1; j <= k; ++j) {
      m[k] += binomial * cumulant[j] * m[k - j];
      binomial = binomial * static_cast<long double>(k - j) / static_cast<long double>(j);
    }
  }
  return m;
}

}  // namespace

TEST_CASE("the rule keeps 2q moments for every start and every number of degrees of freedom") {
  for (const double c : {0.01, 0.25, 4.0})
    for (const double a : {0.0, 1e-6, 0.02, 0.18})
      for (const double b : {-0.5, 0.0, 0.3})
        for (const double s : {0.01, 0.3, 5.0})
          for (const double x : {0.0, 1e-8, 1e-3, 0.1, 3.0})
            for (const std::size_t q : {2U, 3U, 4U}) {
              INFO("a " << a << ", b " << b << ", c " << c << ", s " << s << ", x " << x << ", q " << q);
              const SquareRootRule rule({a, b, c}, s, q);
              const SquareRootRule::Children children = rule.children(x);
              const auto exact = moments({a, b, c}, s, x);
              for (std::size_t k = 0; k < 2 * q; ++k) {
                double moment = 0;
                for (std::size_t i = 0; i < q; ++i)
                  moment += children.weight[i] * std::pow(children.v[i], static_cast<double>(k));
                // All terms are positive; the recurrence loses two or three digits of extended precision.
                CHECK(moment == Approx(static_cast<double>(exact[k])).epsilon(1e-11).margin(0));
              }
              for (std::size_t i = 0; i < q; ++i) {
                CHECK(children.v[i] >= 0);
                CHECK(children.weight[i] > 0);
                CHECK(children.share[i][0] + children.share[i][1] == Approx(1).epsilon(1e-15));
                CHECK((children.integral[i][0] >= 0 && children.integral[i][1] >= 0));
              }
            }
}

TEST_CASE("the integral of the process has its mean and second moments, near 0 as well") {
  const double a = 0.08, b = -2, c = 0.09, s = 0.1, x = GENERATE(0.05, 1e-3, 0.0);
  const SquareRootRule::Children children = SquareRootRule({a, b, c}, s, 4).children(x);
  double I = 0, II = 0, Iv = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t f = 0; f < 2; ++f) {
      const double weight = children.weight[i] * children.share[i][f], value = children.integral[i][f];
      I += weight * value;
      II += weight * value * value;
      Iv += weight * value * children.v[i];
    }
  }
  const double k = -b, theta = a / k, e = std::exp(-k * s);
  const double mean = theta * s + (x - theta) * (1 - e) / k;
  CHECK(I == Approx(mean).epsilon(1e-13));
  const double covariance = [&] {  // Cov(I, v_s) = int_0^s e^{-k (s-u)} Var v_u du, Simpson's rule
    const auto variance = [&](double u) {
      const double g = std::exp(-k * u);
      return x * c / k * (g - g * g) + theta * c / (2 * k) * (1 - g) * (1 - g);
    };
    double sum = 0;
    constexpr int n = 200;
    for (int i = 0; i <= n; ++i) {
      const double u = s * i / n, weight = i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2;
      sum += weight * std::exp(-k * (s - u)) * variance(u);
    }
    return sum * s / n / 3;
  }();
  CHECK(Iv - I * (theta + (x - theta) * e) == Approx(covariance).epsilon(1e-8));
  const double variance = [&] {  // Var I = 2 int_0^s Cov(I_u, v_u) du
    const auto covariance_at = [&](double t) {
      double sum = 0;
      constexpr int n = 100;
      for (int i = 0; i <= n; ++i) {
        const double u = t * i / n, weight = i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2, g = std::exp(-k * u);
        sum += weight * std::exp(-k * (t - u)) *
               (x * c / k * (g - g * g) + theta * c / (2 * k) * (1 - g) * (1 - g));
      }
      return sum * t / n / 3;
    };
    double sum = 0;
    constexpr int n = 100;
    for (int i = 0; i <= n; ++i)
      sum += (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2) * covariance_at(s * i / n);
    return 2 * sum * s / n / 3;
  }();
  CHECK(II - I * I == Approx(variance).epsilon(1e-6));
}

TEST_CASE("what is no square-root process is refused") {
  CHECK_THROWS_AS(SquareRootRule({-0.1, -1, 1}, 0.1, 3), InputError);
  CHECK_THROWS_AS(SquareRootRule({0.1, -1, 0}, 0.1, 3), InputError);
  CHECK_THROWS_AS(SquareRootRule({0.1, -1, 1}, 0, 3), InputError);
  CHECK_THROWS_AS(SquareRootRule({0.1, -1, 1}, 0.1, 5), InputError);
  // Absorbed in 0.
  const SquareRootRule::Children children = SquareRootRule({0, -1, 1}, 0.1, 3).children(0);
  CHECK(children.v[2] == 0);
  CHECK(children.integral[1][0] == 0);
}
