#include "wienertree/model/observation_density.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

using namespace wienertree;

namespace {

// h(x) = x in k components; nothing else is asked of it.
class IdentitySensor final : public VectorFields {
 public:
  explicit IdentitySensor(std::size_t k) : k_(k) {}
  std::size_t state_dimension() const override { return k_; }
  std::size_t noise_dimension() const override { return 1; }
  std::size_t sensor_dimension() const override { return k_; }
  void direct(ConstBatchView, std::span<const double>, BatchView) const override { FAIL(); }
  void jacobian(ConstBatchView, std::span<const double>, BatchView) const override { FAIL(); }
  void euler_step(ConstBatchView, double, ConstBatchView, BatchView) const override { FAIL(); }
  void ito_drift(ConstBatchView, BatchView) const override { FAIL(); }
  void diffusion(ConstBatchView, BatchView) const override { FAIL(); }
  void sensor(ConstBatchView x, BatchView out) const override {
    for (std::size_t i = 0; i < k_; ++i)
      std::copy_n(x.component(i).data(), x.nodes(), out.component(i).data());
  }
  void sensor_derivative(ConstBatchView, BatchView) const override { FAIL(); }

 private:
  std::size_t k_;
};

const std::vector<NoiseLaw> laws{{NoiseLaw::Kind::gaussian, 0.7, 1},
                                 {NoiseLaw::Kind::laplace, 1.3, 1},
                                 {NoiseLaw::Kind::student_t, 0.8, 3.5},
                                 {NoiseLaw::Kind::log_chi_square, 1, 1}};

// log g(v) for each v.
std::vector<double> log_g(const NoiseLaw& law, const std::vector<double>& v) {
  const auto density = make_additive_noise(std::make_shared<IdentitySensor>(1), {law});
  Batch x(1, v.size());
  for (std::size_t n = 0; n < v.size(); ++n) x(0, n) = -v[n];
  std::vector<double> out(v.size());
  const double y = 0;
  density->log_density({&y, 1}, x, out);
  return out;
}

// The substitution v = sinh(u) with equal steps in u reaches the heavy tails; 0 is a point of the grid, where
// Laplace's density has its kink.
struct Grid {
  std::vector<double> v, weight;
};
Grid sinh_grid() {
  constexpr int half = 20000;
  constexpr double reach = 20;
  Grid grid;
  for (int i = -half; i <= half; ++i) {
    const double u = reach * i / half;
    grid.v.push_back(std::sinh(u));
    grid.weight.push_back(std::cosh(u) * reach / half);
  }
  return grid;
}

}  // namespace

TEST_CASE("Student's law of many degrees of freedom goes over into Gauss's") {
  // With n degrees of freedom, log g(v) = -v^2/2 - log(2 pi)/2 + (v^4/4 - v^2/2 - 1/4)/n + O(n^-2) for scale 1.
  const std::vector<double> v = {0, 0.3, -1, 2.5, -4, 6};
  for (const double n : {99.0, 100.0, 101.0, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14, 1e16, 1e17, 1e100, 1e300}) {
    const NoiseLaw law{NoiseLaw::Kind::student_t, 1, n};
    const std::vector<double> on_tape = log_g(law, v);
    for (std::size_t i = 0; i < v.size(); ++i) {
      const double square = v[i] * v[i];
      const double expected = -square / 2 - 0.5 * std::log(2 * 3.14159265358979323846) +
                              (square * square / 4 - square / 2 - 0.25) / n;
      // The term of second order is (-v^6/6 + v^4/4 + ..)/n^2, below 8000/n^2 for |v| <= 6.
      INFO("n " << n << ", v " << v[i]);
      CHECK(on_tape[i] == Approx(expected).margin(1e-12 + 8000 / (n * n)));
      CHECK(log_noise(law, v[i]) == Approx(expected).margin(1e-12 + 8000 / (n * n)));
    }
    // Far out it is finite, or a weight of zero; never NaN.
    for (const double far : log_g(law, {1e150, 1e160, -1e300})) CHECK(!std::isnan(far));
  }
}

TEST_CASE("every noise law integrates to 1") {
  // The trapezoidal rule with 40 001 points: error 1e-3^2/12 times the jump of the derivative at Laplace's
  // kink, below 1e-6; the tail of Student's law beyond sinh(20) = 2e8 is below 1e-25.
  const Grid grid = sinh_grid();
  for (const NoiseLaw& law : laws) {
    const std::vector<double> log_density = log_g(law, grid.v);
    double total = 0;
    for (std::size_t n = 0; n < grid.v.size(); ++n) total += std::exp(log_density[n]) * grid.weight[n];
    INFO(static_cast<int>(law.kind));
    CHECK(total == Approx(1).epsilon(1e-6));
  }
}

TEST_CASE("densities at single points") {
  const double v = 0.9;
  CHECK(log_g(laws[0], {v})[0] ==
        Approx(-0.5 * v * v / 0.49 - std::log(0.7) - 0.5 * std::log(2 * std::numbers::pi)).epsilon(1e-14));
  CHECK(log_g(laws[1], {-v})[0] == Approx(-v / 1.3 - std::log(2.6)).epsilon(1e-14));
  // Student's law with 1 degree of freedom is Cauchy's.
  CHECK(log_g({NoiseLaw::Kind::student_t, 2, 1}, {v})[0] ==
        Approx(-std::log(2 * std::numbers::pi * (1 + v * v / 4))).epsilon(1e-14));
  CHECK(log_g(laws[3], {v})[0] ==
        Approx(0.5 * (v - std::exp(v)) - 0.5 * std::log(2 * std::numbers::pi)).epsilon(1e-14));
}

TEST_CASE("draws have the law of the density") {
  // Null hypothesis: the draws are independent with distribution function F. Kolmogorov-Smirnov with n = 20
  // 000: P(sqrt(n) D > 2.75) < 2 exp(-2 * 2.75^2) = 5.4e-7 for each law.
  constexpr std::size_t n = 20000;
  const Grid grid = sinh_grid();
  for (const NoiseLaw& law : laws) {
    const auto density = make_additive_noise(std::make_shared<IdentitySensor>(1), {law});
    std::mt19937_64 random(5 + static_cast<unsigned>(law.kind));
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal;
    std::vector<double> draws(n);
    const double x = 0.25;
    for (double& y : draws) {
      const double u = uniform(random), z = normal(random);
      density->sample({&x, 1}, {&u, 1}, {&z, 1}, {&y, 1});
      y -= x;
    }
    std::sort(draws.begin(), draws.end());
    const std::vector<double> log_density = log_g(law, grid.v);
    double F = 0, D = 0;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < grid.v.size(); ++i) {
      const double mass = std::exp(log_density[i]) * grid.weight[i];
      F += 0.5 * mass;
      while (passed < n && draws[passed] <= grid.v[i]) ++passed;
      D = std::max(D, std::abs(F - static_cast<double>(passed) / n));
      F += 0.5 * mass;
    }
    INFO(static_cast<int>(law.kind));
    CHECK(std::sqrt(static_cast<double>(n)) * D < 2.75);
  }
}

TEST_CASE("missing components contribute nothing") {
  const auto density = make_additive_noise(std::make_shared<IdentitySensor>(2), {laws[0], laws[1]});
  Batch x(2, 2);
  x(0, 0) = 0.1, x(1, 0) = 0.2, x(0, 1) = -1, x(1, 1) = 3;
  const double nan = std::nan("");
  const auto evaluate = [&](double y1, double y2) {
    std::vector<double> out(2), y{y1, y2};
    density->log_density(y, x, out);
    return out;
  };
  for (std::size_t n = 0; n < 2; ++n) {
    CHECK(evaluate(1, 2)[n] == Approx(evaluate(1, nan)[n] + evaluate(nan, 2)[n]));
    CHECK(evaluate(1, nan)[n] == log_g(laws[0], {1 - x(0, n)})[0]);
    CHECK(evaluate(nan, nan)[n] == 0);
  }
}

TEST_CASE("variances of Gaussian noise, and of no other") {
  const auto sensor = std::make_shared<IdentitySensor>(2);
  CHECK(make_additive_noise(sensor, {laws[0], laws[0]})->gaussian_variances() ==
        std::vector<double>{0.7 * 0.7, 0.7 * 0.7});
  CHECK(make_additive_noise(sensor, {laws[0], laws[1]})->gaussian_variances().empty());
}

TEST_CASE("laws out of their range are refused") {
  const auto sensor = std::make_shared<IdentitySensor>(1);
  CHECK_THROWS_AS(make_additive_noise(sensor, {{NoiseLaw::Kind::gaussian, 0, 1}}), InputError);
  CHECK_THROWS_AS(make_additive_noise(sensor, {{NoiseLaw::Kind::laplace, std::nan(""), 1}}), InputError);
  CHECK_THROWS_AS(make_additive_noise(sensor, {{NoiseLaw::Kind::student_t, 1, -1}}), InputError);
  CHECK_THROWS_AS(make_additive_noise(sensor, {laws[0], laws[0]}), InputError);
}

TEST_CASE("a density on a tape: values, missing data, no draws") {
  TapeBuilder builder(1, 2);  // -(y1 - x)^2 - (y2 - x)^2
  const auto square = [&](TapeBuilder::Value y) {
    const auto v = builder.binary(Op::subtract, y, builder.input(0));
    return builder.binary(Op::multiply, v, v);
  };
  const auto sum = builder.binary(Op::add, square(builder.uniform(0)), square(builder.uniform(1)));
  const auto output = builder.unary(Op::negate, sum);
  const auto density = make_tape_density(builder.finish(std::span(&output, 1)), "model.toml, log_likelihood");
  CHECK(density->observation_dimension() == 2);
  Batch x(1, 1);
  x(0, 0) = 1;
  double out = 7;
  const double nan = std::nan("");
  std::vector<double> y{2, 3};
  density->log_density(y, x, {&out, 1});
  CHECK(out == -5);
  y = {nan, nan};
  density->log_density(y, x, {&out, 1});
  CHECK(out == 0);
  y = {2, nan};
  CHECK_THROWS_AS(density->log_density(y, x, {&out, 1}), InputError);
  CHECK_THROWS_AS(density->sample({}, {}, {}, y), InputError);
  CHECK(density->gaussian_variances().empty());
}
