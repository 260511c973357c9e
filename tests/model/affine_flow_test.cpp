#include "wienertree/model/affine_flow.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

using namespace wienertree;

namespace {

AffineFields one_field(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) { return {{A}, {b}}; }

// Classical Runge-Kutta of order 4 for dx/du = A x + b on [0, 1].
Eigen::VectorXd runge_kutta(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Eigen::VectorXd x,
                            int steps) {
  const double s = 1.0 / steps;
  const auto f = [&](const Eigen::VectorXd& y) { return Eigen::VectorXd(A * y + b); };
  for (int i = 0; i < steps; ++i) {
    const Eigen::VectorXd k1 = f(x), k2 = f(x + s / 2 * k1), k3 = f(x + s / 2 * k2), k4 = f(x + s * k3);
    x += s / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return x;
}

}  // namespace

TEST_CASE("exp(M) - Id of a nilpotent, a rotation and a large matrix") {
  std::vector<double> F(9), scratch(18);
  const std::vector<double> nilpotent{0, 2, 3, 0, 0, 5, 0, 0, 0};
  exponential_minus_identity(nilpotent, 3, F, scratch);
  const std::vector<double> expected{0, 2, 3 + 5, 0, 0, 5, 0, 0, 0};  // N + N^2/2
  for (std::size_t i = 0; i < 9; ++i) CHECK(F[i] == Approx(expected[i]).epsilon(0).margin(1e-14));
  const double angle = 40;
  const std::vector<double> rotation{0, -angle, angle, 0};
  exponential_minus_identity(rotation, 2, std::span(F).first(4), scratch);
  // Each of the 7 doublings can double the relative error of the angle: 2^7 eps times a small factor.
  CHECK(F[0] == Approx(std::cos(angle) - 1).epsilon(0).margin(1e-12));
  CHECK(F[2] == Approx(std::sin(angle)).epsilon(0).margin(1e-12));
  const double tiny = 1e-18;
  exponential_minus_identity({&tiny, 1}, 1, std::span(F).first(1), scratch);
  CHECK(F[0] == 1e-18);
}

TEST_CASE("scalar flow: closed form, also for vanishing growth") {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Constant(1, 1, -0.7);
  const Eigen::VectorXd b = Eigen::VectorXd::Constant(1, 0.4);
  const AffineFlow flow(one_field(A, b));
  Batch x(1, 1);
  for (const double D : {1.0, 1e-9, -2.0, 30.0, 0.0}) {
    x(0, 0) = 1.3;
    flow(std::span(&D, 1), x);
    CHECK(x(0, 0) == Approx(1.3 * std::exp(-0.7 * D) + 0.4 / 0.7 * (1 - std::exp(-0.7 * D))).epsilon(1e-14));
  }
}

TEST_CASE("translation") {
  const AffineFlow flow({{Eigen::MatrixXd::Zero(2, 2), Eigen::MatrixXd::Zero(2, 2)},
                         {Eigen::Vector2d(1, 2), Eigen::Vector2d(0.5, -1)}});
  Batch x(2, 3);
  for (std::size_t n = 0; n < 3; ++n) x(0, n) = x(1, n) = static_cast<double>(n);
  const std::vector<double> D{2, 4};
  flow(D, x);
  for (std::size_t n = 0; n < 3; ++n) {
    CHECK(x(0, n) == static_cast<double>(n) + 4);
    CHECK(x(1, n) == static_cast<double>(n));
  }
}

TEST_CASE("general flow agrees with Runge-Kutta at tiny steps and with itself inverted") {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (const Eigen::Index d : {2, 3, 6}) {
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(d, d, [&] { return normal(random); });
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(d, [&] { return normal(random); });
    const AffineFlow flow(one_field(A, b));
    const std::size_t N = 300;
    Batch x(static_cast<std::size_t>(d), N), start(static_cast<std::size_t>(d), N);
    for (std::size_t i = 0; i < x.components(); ++i)
      for (std::size_t n = 0; n < N; ++n) x(i, n) = start(i, n) = normal(random);
    const double forward = 1, backward = -1;
    flow(std::span(&forward, 1), x);
    // Error of Runge-Kutta: (|A|/400)^4 |A| |x|/120 < 1e-9 for |A| < 6.
    for (const std::size_t n : {0UL, 127UL, 128UL, 299UL}) {
      Eigen::VectorXd expected(d);
      for (Eigen::Index i = 0; i < d; ++i) expected(i) = start(static_cast<std::size_t>(i), n);
      expected = runge_kutta(A, b, expected, 400);
      for (Eigen::Index i = 0; i < d; ++i)
        CHECK(x(static_cast<std::size_t>(i), n) == Approx(expected(i)).epsilon(1e-8).margin(1e-8));
    }
    flow(std::span(&backward, 1), x);
    for (std::size_t i = 0; i < x.components(); ++i)
      for (std::size_t n = 0; n < N; ++n) CHECK(std::abs(x(i, n) - start(i, n)) < 1e-11);
  }
}

TEST_CASE("a node's flow does not depend on where it sits") {
  Eigen::MatrixXd A(2, 2);
  A << -0.3, 1.1, -0.9, 0.2;
  const AffineFlow flow(one_field(A, Eigen::Vector2d(0.1, -0.2)));
  const double D = 0.77;
  const std::size_t N = 259;
  Batch all(2, N);
  for (std::size_t n = 0; n < N; ++n) {
    all(0, n) = 0.1 * static_cast<double>(n);
    all(1, n) = 3 - 0.07 * static_cast<double>(n);
  }
  for (const std::size_t n : {0UL, 1UL, 63UL, 128UL, 200UL, 258UL}) {
    Batch one(2, 1), batch(2, N);
    for (std::size_t i = 0; i < 2; ++i) {
      one(i, 0) = all(i, n);
      for (std::size_t m = 0; m < N; ++m) batch(i, m) = all(i, m);
    }
    flow(std::span(&D, 1), one);
    flow(std::span(&D, 1), batch);
    for (std::size_t i = 0; i < 2; ++i) CHECK(std::memcmp(&one(i, 0), &batch(i, n), sizeof(double)) == 0);
  }
}
