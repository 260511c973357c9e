/// The first generation, and simulated signals.
#include <catch2/catch.hpp>
#include <cmath>

#include "filter/text_problems.hpp"
#include "wienertree/tree/initial.hpp"

using namespace wienertree;

namespace {

Model with_initial_law(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) {
  std::string text = "name = \"m\"\nconvention = \"ito\"\n[state]\n", drift = "[drift]\n",
              diffusion = "[diffusion]\n";
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    const std::string x = std::string("x").append(std::to_string(i));
    text += x + " = { initial = 0 }\n";
    drift += x + " = \"0\"\n";
    diffusion += x + " = [\"1\"]\n";
  }
  Model m = parse_model(text + drift + diffusion, "m.toml", {});
  m.initial_law = InitialLaw{mean, covariance};
  return m;
}

double log_mass(const Generation& g) {
  double sum = 0;
  for (const double w : g.log_weight) sum += std::exp(w);
  return std::log(sum);
}

}  // namespace

TEST_CASE("a Gaussian start has mass one, its mean and its covariance, also when singular") {
  Eigen::Matrix3d L;
  L << 1, 0, 0, 0.5, 2, 0, -1, 0.3, 0;
  const Eigen::Vector3d mean(1, -2, 3);
  for (const std::size_t nodes : {10U, 400U, 5000U}) {
    const Generation g = first_generation(with_initial_law(mean, L * L.transpose()), nodes);
    CHECK(g.size() <= std::max<std::size_t>(nodes, 1000));
    CHECK(log_mass(g) == Approx(0).epsilon(0).margin(1e-13));
    // 400 nodes on rank 2: 20 an axis, spacing 0.63, error of the trapezoidal rule
    // exp(-2 pi^2/0.63^2) < 1e-21, beyond 6 sd 1e-7.
    Eigen::Vector3d m = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (std::size_t n = 0; n < g.size(); ++n) {
      const Eigen::Vector3d x(g.states(0, n), g.states(1, n), g.states(2, n));
      m += std::exp(g.log_weight[n]) * x;
      second += std::exp(g.log_weight[n]) * (x - mean) * (x - mean).transpose();
    }
    CHECK((m - mean).norm() < 1e-6);
    CHECK((second - L * L.transpose()).norm() < 1e-6);
  }
}

TEST_CASE("a fixed start is one node, and an indefinite covariance is refused") {
  CHECK(first_generation(benes_cases[1].model(), 100).size() == 1);
  Eigen::Matrix2d bad;
  bad << 1, 2, 2, 1;
  CHECK_THROWS_AS(first_generation(with_initial_law(Eigen::Vector2d::Zero(), bad), 10), InputError);
}

TEST_CASE("simulated Ornstein-Uhlenbeck signals have the right mean and variance") {
  const Model model = parse_model(
      "name = \"ou\"\nconvention = \"ito\"\n[state]\nx = { initial = 2 }\n[drift]\nx = "
      "\"-x\"\n[diffusion]\nx = [\"0.5\"]\n"
      "[observation]\nkind = \"continuous\"\nh = [\"3\"]\n",
      "ou.toml", {});
  // Null hypothesis: X_1 ~ N(2 (1-dt)^100, 0.25 dt (1-q^100)/(1-q)), q = (1-dt)^2, dt = 0.01 (the Euler
  // chain's own law); Y_1 ~ N(3, 1). 4000 draws; |z| > 5.5 has probability 4e-8 (the variance's z from its
  // chi-square's normal limit).
  constexpr int draws = 4000;
  double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
  for (std::uint32_t i = 0; i < draws; ++i) {
    const Simulation s = simulate(model, 1, 100, 1, 77, i);
    const double x = s.signal.row(1)[0], y = s.observations.row(1)[0];
    x1 += x / draws;
    x2 += x * x / draws;
    y1 += y / draws;
    y2 += y * y / draws;
  }
  const double q = 0.99 * 0.99, mean = 2 * std::pow(0.99, 100),
               variance = 0.25 * 0.01 * (1 - std::pow(q, 100)) / (1 - q);
  CHECK(std::abs(x1 - mean) < 5.5 * std::sqrt(variance / draws));
  CHECK(std::abs((x2 - x1 * x1) / variance - 1) < 5.5 * std::sqrt(2.0 / draws));
  CHECK(std::abs(y1 - 3) < 5.5 * std::sqrt(1.0 / draws));
  CHECK(std::abs(y2 - y1 * y1 - 1) < 5.5 * std::sqrt(2.0 / draws));
}

TEST_CASE("simulation refuses bad arguments and names a state that leaves its bounds") {
  const Model model = benes_cases[1].model();
  CHECK_THROWS_WITH(simulate(model, -1, 10, 10, 1), Catch::Contains("horizon"));
  CHECK_THROWS_WITH(simulate(model, 1, 0, 10, 1), Catch::Contains("steps"));
  CHECK_THROWS_WITH(simulate(model, 1, 10, 3, 1), Catch::Contains("keep"));
  const Model bounded = parse_model(
      "name = \"b\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.1, lower = 0.0 }\n[drift]\nx = \"-5\"\n"
      "[diffusion]\nx = [\"0.1\"]\n",
      "b.toml", {});
  CHECK_THROWS_WITH(simulate(bounded, 1, 100, 1, 1), Catch::Contains("state x at t ="));
}
