#include "wienertree/filter/functional.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "wienertree/numeric/random.hpp"

using namespace wienertree;

namespace {

void fill(Batch& b, std::uint32_t stream) {
  for (std::size_t i = 0; i < b.components(); ++i)
    RandomStream{11, stream, static_cast<std::uint32_t>(i), Purpose::signal_noise}.normals(0, b.component(i));
}

// A window whose rows are Brownian: k components, `rows` rows on [0.3, 0.8].
struct Observed {
  std::vector<double> t, y;
  ObservationWindow window;
  Observed(std::size_t k, std::size_t rows) : t(rows), y(rows * k) {
    RandomStream{3, 0, 0, Purpose::observation_noise}.normals(0, y);
    for (std::size_t r = 0; r < rows; ++r)
      t[r] = 0.3 + 0.5 * static_cast<double>(r) / static_cast<double>(rows - 1);
    window.start = 0.3;
    window.end = 0.8;
    window.row_times = t;
    window.row_values = y;
    integrate_rows(window, k);
  }
};

std::vector<double> log_weights(FunctionalMethod method, const ObservationWindow& w, const Batch& h0,
                                const Batch& G, const Batch& h1) {
  const auto functional = make_functional(method);
  std::vector<double> out(h0.nodes());
  functional->at_start(w, h0, G, out);
  if (functional->uses_end()) functional->at_end(w, h0, G, h1, out);
  return out;
}

Eigen::VectorXd node(const Batch& b, std::size_t n) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(b.components()));
  for (std::size_t i = 0; i < b.components(); ++i) v(static_cast<Eigen::Index>(i)) = b(i, n);
  return v;
}

}  // namespace

TEST_CASE("each functional equals its formula, for several k and p") {
  for (const auto& [k, p] : {std::pair<std::size_t, std::size_t>{1, 1}, {2, 3}, {3, 1}, {2, 2}})
    for (const std::size_t rows : {2, 9}) {
      constexpr std::size_t N = 70;  // more than a block of the sums over nodes
      Batch h0(k, N), h1(k, N), G(k * p, N);
      fill(h0, 1);
      fill(h1, 2);
      fill(G, 3);
      const Observed o(k, rows);
      const auto K = static_cast<Eigen::Index>(k), P = static_cast<Eigen::Index>(p);
      const Eigen::Map<const Eigen::VectorXd> D(o.window.increment.data(), K), I(o.window.integral.data(), K),
          A(o.window.bridge_start.data(), K), B(o.window.bridge_end.data(), K);
      const Eigen::Map<const Eigen::MatrixXd> C(o.window.covariation.data(), K, K);
      const double s = o.window.length();
      const auto picard = log_weights(FunctionalMethod::picard, o.window, h0, G, h1);
      const auto trapezoid = log_weights(FunctionalMethod::trapezoid, o.window, h0, G, h1);
      const auto second = log_weights(FunctionalMethod::second_order, o.window, h0, G, h1);
      for (std::size_t n = 0; n < N; ++n) {
        const Eigen::VectorXd a = node(h0, n), b = node(h1, n);
        const Eigen::VectorXd g = node(G, n);
        const Eigen::MatrixXd g_matrix = Eigen::Map<const Eigen::MatrixXd>(g.data(), P, K).transpose();
        const double quadratic = s / 6 * (a.dot(a) + a.dot(b) + b.dot(b));
        CHECK(picard[n] == Approx(a.dot(D) - s / 2 * a.dot(a)).epsilon(1e-13));
        CHECK(trapezoid[n] == Approx((a + b).dot(D) / 2 - quadratic).epsilon(1e-13));
        const Eigen::MatrixXd c = A * a.transpose() + B * b.transpose();
        const Eigen::MatrixXd R = s * s * s *
                                  ((a * a.transpose() + b * b.transpose()) / 45 +
                                   7 * (a * b.transpose() + b * a.transpose()) / 360);
        const Eigen::MatrixXd M = C - s * s / 6 * Eigen::MatrixXd::Identity(K, K) - c - c.transpose() + R;
        const double theta = 1 / (1 + s * s * g.squaredNorm() / (std::numbers::pi * std::numbers::pi));
        const double trace = theta * (g_matrix.transpose() * M * g_matrix).trace() / 2;
        CHECK(second[n] ==
              Approx(a.dot(D) + (b - a).dot(I) / s - quadratic + trace).epsilon(1e-12).margin(1e-13));
      }
    }
}

TEST_CASE("for a constant sensor every functional is the Girsanov weight h.D - s|h|^2/2") {
  Batch h(2, 3), G(2, 3);
  for (std::size_t n = 0; n < 3; ++n) {
    h(0, n) = 0.7;
    h(1, n) = -1.2;
    G(0, n) = G(1, n) = 0;
  }
  const Observed o(2, 5);
  const double expected = 0.7 * o.window.increment[0] - 1.2 * o.window.increment[1] -
                          o.window.length() / 2 * (0.7 * 0.7 + 1.2 * 1.2);
  for (const auto method :
       {FunctionalMethod::picard, FunctionalMethod::trapezoid, FunctionalMethod::second_order})
    for (const double w : log_weights(method, o.window, h, G, h)) CHECK(w == Approx(expected).epsilon(1e-13));
}

namespace {

// log E[exp(int h dY - 1/2 int h^2) | both ends] for h(X_u) = l_u + g b_u, l linear from h0 to h1, b a
// Brownian bridge on [0,s], Y linear between its rows. In the eigenfunctions sqrt(2/s) sin(j pi u/s) of b's
// covariance, with eigenvalues v_j = (s/(j pi))^2 and c_j the coefficients of dY - l du, it is
//     int l dY - 1/2 int l^2 + sum_j 1/2 g^2 v_j c_j^2 / (1 + g^2 v_j) - 1/2 log(sinh(g s)/(g s)).
double exact_log_weight(const std::vector<double>& y, double s, double h0, double h1, double g) {
  const std::size_t gaps = y.size() - 1;
  const double delta = s / static_cast<double>(gaps), increment = h1 - h0;
  double sum = -s / 6 * (h0 * h0 + h0 * h1 + h1 * h1);
  for (std::size_t r = 0; r < gaps; ++r)
    sum += (y[r + 1] - y[r]) * (h0 + increment * (static_cast<double>(r) + 0.5) / static_cast<double>(gaps));
  for (int j = 1; j <= 4000; ++j) {
    const double k = j * std::numbers::pi / s, v = 1 / (k * k);
    double c = -(h0 - (j % 2 == 0 ? 1 : -1) * h1) / k;  // int l sin(k u) du = (l_0 - l_s cos(k s)) / k
    for (std::size_t r = 0; r < gaps; ++r) {
      const double u = delta * static_cast<double>(r);
      c += (y[r + 1] - y[r]) / delta * (std::cos(k * u) - std::cos(k * (u + delta))) / k;
    }
    c *= std::sqrt(2 / s);
    sum += 0.5 * g * g * v * c * c / (1 + g * g * v);
  }
  return sum - 0.5 * std::log(std::sinh(g * s) / (g * s));
}

// The functional less the exact value, on a path whose increments scale as Brownian motion's.
double local_error(double s, double h0, double h1, double g) {
  constexpr std::size_t rows = 9;
  std::vector<double> t(rows), y(rows, 0.0), z(rows - 1);
  RandomStream{5, 0, 0, Purpose::observation_noise}.normals(0, z);
  for (std::size_t r = 0; r < rows; ++r) t[r] = s * static_cast<double>(r) / (rows - 1);
  for (std::size_t r = 1; r < rows; ++r) y[r] = y[r - 1] + std::sqrt(s / (rows - 1)) * z[r - 1];
  ObservationWindow w;
  w.end = s;
  w.row_times = t;
  w.row_values = y;
  integrate_rows(w, 1, true);
  Batch a(1, 1), b(1, 1), G(1, 1);
  a(0, 0) = h0;
  b(0, 0) = h1;
  G(0, 0) = g;
  return log_weights(FunctionalMethod::second_order, w, a, G, b)[0] - exact_log_weight(y, s, h0, h1, g);
}

}  // namespace

TEST_CASE("second-order: local error O(s^4) where h is linear and the noise constant") {
  // Local errors e(s) = C s^4 + O(s^{9/2}); from s = 1/8 to 1/32 the factor is 256, more than 4^3.5 = 128
  // asked.
  for (const auto& [h0, h1, g] : {std::tuple{0.7, 1.1, 0.8}, {-2.0, -1.5, 1.3}, {0.0, 0.4, 0.5}}) {
    const double coarse = local_error(1.0 / 8, h0, h1, g), fine = local_error(1.0 / 32, h0, h1, g);
    CHECK(std::abs(coarse) < 1e-3);
    CHECK(std::abs(fine) < std::abs(coarse) / 128);
  }
}

TEST_CASE("second-order: the weight falls for nodes far away, however long the step") {
  const Observed o(1, 9);
  const auto weight = [&](double h0, double h1, double g) {
    Batch a(1, 1), b(1, 1), G(1, 1);
    a(0, 0) = h0;
    b(0, 0) = h1;
    G(0, 0) = g;
    return log_weights(FunctionalMethod::second_order, o.window, a, G, b)[0];
  };
  for (const double g : {0.1, 1.0, 10.0, 1000.0})
    for (const auto& [h0, h1] : {std::pair{1e4, 1e4}, {1e4, -1e4}, {1e4, 0.0}, {0.0, -1e4}})
      CHECK(weight(h0, h1, g) < weight(0, 0, g));
}
