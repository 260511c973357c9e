/// The Kalman-Bucy filter and its Riccati equation.
#include "wienertree/filter/riccati.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "filter/linear_problems.hpp"
#include "wienertree/filter/benes_filter.hpp"
#include "wienertree/filter/kalman_bucy_filter.hpp"
#include "wienertree/filter/kalman_filter.hpp"
#include "wienertree/filter/simulate.hpp"

using namespace wienertree;

namespace {

struct State {
  Eigen::VectorXd m;
  Eigen::MatrixXd P;
  double log_evidence;
};

// The filter's equations for Y linear between rows, by the classical Runge-Kutta method on 200 steps a gap.
State runge_kutta(const LinearProblem& l, const ObservationPath& path, State x) {
  const Eigen::MatrixXd Q = l.B * l.B.transpose();
  const auto k = static_cast<Eigen::Index>(path.dimension);
  for (std::size_t r = 0; r + 1 < path.rows(); ++r) {
    const double gap = path.times[r + 1] - path.times[r], s = gap / 200;
    const Eigen::VectorXd y = (Eigen::Map<const Eigen::VectorXd>(path.row(r + 1).data(), k) -
                               Eigen::Map<const Eigen::VectorXd>(path.row(r).data(), k)) /
                              gap;
    const auto slope = [&](const State& u) {
      const Eigen::MatrixXd K = u.P * l.H.transpose();
      const Eigen::VectorXd h = l.H * u.m + l.c;
      return State{l.A * u.m + l.a + K * (y - h), l.A * u.P + u.P * l.A.transpose() + Q - K * K.transpose(),
                   h.dot(y) - h.squaredNorm() / 2 - (l.H * K).trace() / 2};
    };
    const auto moved = [](const State& u, const State& v, double t) {
      return State{u.m + t * v.m, u.P + t * v.P, u.log_evidence + t * v.log_evidence};
    };
    for (int i = 0; i < 200; ++i) {
      const State k1 = slope(x), k2 = slope(moved(x, k1, s / 2)), k3 = slope(moved(x, k2, s / 2)),
                  k4 = slope(moved(x, k3, s));
      x = moved(moved(moved(moved(x, k1, s / 6), k2, s / 3), k3, s / 3), k4, s / 6);
    }
  }
  return x;
}

Posterior filtered(Filter& filter, const ObservationPath& path, std::size_t steps) {
  const std::size_t gaps = path.rows() - 1;
  run(filter, ObservationWindows(path, rows_on_grid(path.times, steps == 0 ? gaps : steps), true), {});
  return filter.posterior();
}

}  // namespace

TEST_CASE("Kalman-Bucy filter: equals its equations solved by another method") {
  unsigned seed = 20;
  for (const auto& [d, p, k] : {std::array<Eigen::Index, 3>{1, 1, 1}, {2, 1, 1}, {3, 2, 2}, {4, 3, 2}})
    for (const bool random_start : {false, true}) {
      const LinearProblem l(d, p, k, ++seed);
      const Model model = l.model("kind = \"continuous\"", random_start);
      const ObservationPath path = simulate(model, 3, 3000, 30, seed).observations;
      State start{l.start, random_start ? l.start_covariance : Eigen::MatrixXd::Zero(d, d), 0};
      const State exact = runge_kutta(l, path, start);
      for (const std::size_t steps : {0, 7, 1}) {
        KalmanBucyFilter filter(model);
        const Posterior q = filtered(filter, path, steps);
        INFO("d = " << d << ", random start " << random_start << ", steps " << steps);
        // Runge-Kutta: (|F| s)^4/120 with |F| s at most 5 * 5e-4: 1e-12. CVODE: 1e-12 a step, some hundred
        // steps.
        CHECK((mean_of(q) - exact.m).norm() < 1e-9);
        CHECK((covariance_of(q) - exact.P).norm() < 1e-9);
        CHECK(q.log_evidence == Approx(exact.log_evidence).epsilon(0).margin(1e-9));
      }
    }
}

TEST_CASE("Riccati equation: the limit solves the algebraic equation, from above and from below") {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const LinearProblem l(4, 4, 3, seed);
    const Eigen::MatrixXd Q = l.B * l.B.transpose(), zero = Eigen::MatrixXd::Zero(4, 4);
    Eigen::MatrixXd P, from_above;
    RiccatiEquation(l.A, Q, l.H, zero, 0.1).at(200, P);
    RiccatiEquation(l.A, Q, l.H, 1e6 * Eigen::MatrixXd::Identity(4, 4), 0.1).at(200, from_above);
    const Eigen::MatrixXd terms = l.A * P, gain = P * l.H.transpose();
    const double residual = (terms + terms.transpose() + Q - gain * gain.transpose()).norm();
    CHECK(residual < 1e-9 * (2 * terms.norm() + Q.norm() + gain.squaredNorm()));
    CHECK((P - from_above).norm() < 1e-9 * P.norm());
    // and it is the stabilising solution
    CHECK((l.A - gain * l.H).eigenvalues().real().maxCoeff() < 0);
  }
}

TEST_CASE("Riccati equation: a state of size 1e-6 beside one of size 1 keeps its digits") {
  // Two scalar equations: P' = 1 - P^2 h^2/.. with q = s^2, h = 1/s has P = s^2 tanh(t).
  const Eigen::Vector2d s(1, 1e-6);
  const Eigen::MatrixXd Q = s.array().square().matrix().asDiagonal(), H = s.cwiseInverse().asDiagonal();
  Eigen::MatrixXd P;
  RiccatiEquation riccati(Eigen::MatrixXd::Zero(2, 2), Q, H, Eigen::MatrixXd::Zero(2, 2), 0.01);
  for (const double t : {0.01, 0.02, 0.5, 3.0}) {
    riccati.at(t, P);
    CHECK(P(0, 0) == Approx(std::tanh(t)).epsilon(1e-9));
    CHECK(P(1, 1) == Approx(1e-12 * std::tanh(t)).epsilon(1e-5));
  }
}

TEST_CASE("Kalman-Bucy filter: without drift it is Benes' filter with mu = 0") {
  Model model = parse_model(
      "name = \"b\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.4 }\n[drift]\nx = "
      "\"0\"\n[diffusion]\nx = "
      "[\"0.8\"]\n[observation]\nkind = \"continuous\"\nh = [\"0.6*x + 0.3\"]\n",
      "b.toml", {});
  model.benes = BenesParameters{0, 0.8, 0.6, 0.3, 0.4};
  const ObservationPath path = simulate(model, 5, 5000, 500, 3).observations;
  KalmanBucyFilter filter(model);
  BenesFilter benes(model);
  const Posterior p = filtered(filter, path, 0), q = filtered(benes, path, 0);
  CHECK(mean(p, 0) == Approx(mean(q, 0)).epsilon(0).margin(1e-10));
  CHECK(covariance(p, 0, 0) == Approx(covariance(q, 0, 0)).epsilon(1e-10));
  // Benes' evidence by Simpson's rule: (c gap)^5/2880 of |Y'|^2 a gap,
  // (0.48 * 0.01)^4 * 0.01 * 5e4/2880 = 1e-10.
  CHECK(p.log_evidence == Approx(q.log_evidence).epsilon(0).margin(1e-9));
}

TEST_CASE("Kalman-Bucy filter: the evidence obeys the innovations formula d log rho = h^ dY - |h^|^2 dt/2") {
  const LinearProblem l(3, 2, 2, 40);
  const Model model = l.model("kind = \"continuous\"", true);
  constexpr std::size_t rows = 100'000;
  constexpr double horizon = 4;
  const auto path = simulate(model, horizon, rows, rows, 6).observations;
  KalmanBucyFilter filter(model);
  ObservationWindows windows(path, model.observation, model.timing, 0);
  ObservationWindow w;
  Eigen::VectorXd h = l.H * l.start + l.c;
  double expected = 0, largest_gain = 0;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, w);
    expected +=
        h.dot(Eigen::Map<const Eigen::VectorXd>(w.increment.data(), 2)) - h.squaredNorm() / 2 * w.length();
    filter.advance(w);
    const Posterior& p = filter.posterior();
    h = l.H * mean_of(p) + l.c;
    largest_gain = std::max(largest_gain, (l.H * covariance_of(p) * l.H.transpose()).norm());
  }
  // The left-point Ito sum misses sum_gap (dW^T gain dW - tr gain dt)/2, of variance at most |gain|^2 T dt/2.
  // Null hypothesis: the two agree up to that; 6 standard deviations, false alarms 2e-9.
  const double sd = largest_gain * std::sqrt(horizon * horizon / rows / 2);
  CHECK(filter.posterior().log_evidence == Approx(expected).margin(6 * sd));
  CHECK(6 * sd < 0.5);
}

TEST_CASE("Kalman-Bucy filter: a constant sensor leaves the prior law, with Girsanov's evidence") {
  LinearProblem l(2, 2, 1, 50);
  l.H.setZero();
  const Model model = l.model("kind = \"continuous\"", false), prior = l.model("", false);
  const ObservationPath path = simulate(model, 2, 100, 10, 3).observations;
  KalmanBucyFilter filter(model), none(prior);
  KalmanFilter kalman(prior);
  const Posterior p = filtered(filter, path, 0);
  ObservationWindow w;
  w.end = 2;
  none.advance(w);
  kalman.advance(w);
  const double c = l.c(0), D = path.values.back() - path.values.front();
  CHECK(p.log_evidence == Approx(c * D - c * c / 2 * 2).epsilon(1e-11));
  for (Filter* f : {static_cast<Filter*>(&none), static_cast<Filter*>(&filter)}) {
    CHECK((mean_of(f->posterior()) - mean_of(kalman.posterior())).norm() < 1e-10);
    CHECK((covariance_of(f->posterior()) - covariance_of(kalman.posterior())).norm() < 1e-10);
  }
  CHECK(none.posterior().log_evidence == 0);
}

TEST_CASE("Kalman-Bucy filter: a vague start and a long run stay finite and right") {
  LinearProblem l(2, 2, 2, 60);
  l.start_covariance = 1e8 * Eigen::MatrixXd::Identity(2, 2);
  const Model model = l.model("kind = \"continuous\"", true);
  const ObservationPath path =
      simulate(l.model("kind = \"continuous\"", false), 400, 4000, 4000, 3).observations;
  KalmanBucyFilter filter(model);
  const Posterior p = filtered(filter, path, 0);
  Eigen::MatrixXd P;
  RiccatiEquation(l.A, l.B * l.B.transpose(), l.H, Eigen::MatrixXd::Zero(2, 2), 0.1).at(400, P);
  CHECK((covariance_of(p) - P).norm() < 1e-9);
  CHECK((mean_of(p).allFinite() && std::isfinite(p.log_evidence)));
}

TEST_CASE("Kalman-Bucy filter: discrete observations are refused") {
  const LinearProblem l(1, 1, 1, 9);
  const Model model = l.model("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1 }", false);
  CHECK_THROWS_AS(KalmanBucyFilter(model), InputError);
}
