#include "wienertree/filter/functional.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "wienertree/tree/random.hpp"

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
  if (functional->uses_end()) functional->at_end(w, h0, h1, out);
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
      constexpr std::size_t N = 7;
      Batch h0(k, N), h1(k, N), G(k * p, N);
      fill(h0, 1);
      fill(h1, 2);
      fill(G, 3);
      const Observed o(k, rows);
      const auto K = static_cast<Eigen::Index>(k), P = static_cast<Eigen::Index>(p);
      const Eigen::Map<const Eigen::VectorXd> D(o.window.increment.data(), K), I(o.window.integral.data(), K);
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
        const double trace =
            (g_matrix.transpose() * (C - s * s / 6 * Eigen::MatrixXd::Identity(K, K)) * g_matrix).trace() / 2;
        CHECK(second[n] ==
              Approx(a.dot(D) + (b - a).dot(I) / s - quadratic + trace).epsilon(1e-12).margin(1e-13));
        if (rows == 2) CHECK(second[n] == Approx(trapezoid[n]).epsilon(1e-12));
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
