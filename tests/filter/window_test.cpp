#include "wienertree/filter/window.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/numeric/random.hpp"

using namespace wienertree;

namespace {

ObservationPath path_of(const std::vector<double>& t, const std::vector<double>& y) {
  ObservationPath p;
  p.dimension = y.size() / t.size();
  p.times = t;
  p.values = y;
  return p;
}

ObservationWindow only_window(const ObservationPath& path) {
  ObservationWindow w;
  ObservationWindows(path, ObservationKind::continuous, ObservationTiming::current, 1).get(0, w);
  return w;
}

}  // namespace

TEST_CASE("without a row inside the path is linear, and its increment's likelihood asks for a bridge") {
  const auto path = path_of({1.0, 1.5}, {2.0, 0.0, 3.0, -1.0});
  const auto w = only_window(path);
  CHECK(w.increment == std::vector{1.0, -1.0});
  CHECK(w.integral[0] == Approx(0.25));
  CHECK(w.bridge == Approx(0.25 / 6));
  CHECK(w.covariation[0] == Approx(0.5 / 12 + 0.25 / 6));  // U = D (1 - u/s): s D D^T/12
  CHECK(w.covariation[1] == Approx(-0.5 / 12));
  CHECK(w.bridge_start[0] == Approx(0.25 / 24));  // U = D (1 - u/s): s^2 D/24
  CHECK(w.bridge_end[1] == Approx(-0.25 / 24));
}

TEST_CASE("on many rows integral and covariation converge to their definition") {
  // Y_u = (u, u^2) on [0, 1]: U = (1 - u, 1 - u^2); I = (1/2, 2/3); int U U^T = (1/3, 5/12; 5/12, 8/15).
  constexpr std::size_t rows = 2001;
  std::vector<double> t, y;
  for (std::size_t r = 0; r < rows; ++r) {
    t.push_back(static_cast<double>(r) / (rows - 1));
    y.push_back(t.back());
    y.push_back(t.back() * t.back());
  }
  const auto path = path_of(t, y);
  const auto w = only_window(path);
  // The bridge part is sum delta^2/6 = 1/(6*2000) = 8.4e-5, the quadrature error O(delta^2) = 1e-7.
  const double bridge = 1.0 / 12000;
  CHECK(w.integral[0] == Approx(0.5).margin(1e-6));
  CHECK(w.integral[1] == Approx(2.0 / 3).margin(1e-6));
  CHECK(w.covariation[0] == Approx(1.0 / 3 - 1.0 / 4 + bridge).margin(1e-6));
  CHECK(w.covariation[1] == Approx(5.0 / 12 - 1.0 / 3).margin(1e-6));
  CHECK(w.covariation[2] == w.covariation[1]);
  CHECK(w.covariation[3] == Approx(8.0 / 15 - 4.0 / 9 + bridge).margin(1e-6));
  // K, the Brownian bridge's covariance operator on [0,1], takes 1 to u(1-u)/2 and u to (u/6)(1-u^2):
  // int (K u) dY = 1/24, 2/45 and int (K 1) dY = 1/12, 1/12.
  CHECK(w.bridge_end[0] == Approx(1.0 / 24).margin(1e-6));
  CHECK(w.bridge_end[1] == Approx(2.0 / 45).margin(1e-6));
  CHECK(w.bridge_start[0] == Approx(1.0 / 24).margin(1e-6));
  CHECK(w.bridge_start[1] == Approx(1.0 / 12 - 2.0 / 45).margin(1e-6));
}

TEST_CASE("rows at unequal times, one component among several") {
  // A linear component has the same integrals whatever the rows are, and 19 gaps are two full blocks and a
  // rest.
  std::vector<double> t{2.0}, y{0.0, 1.0, 0.0};
  for (int r = 1; r < 20; ++r) {
    t.push_back(t.back() + 0.01 * (1 + r % 4));
    const double u = t.back() - 2.0;
    y.insert(y.end(), {u * u, 1.0 - 3 * u, std::sin(9 * u)});
  }
  const auto path = path_of(t, y);
  const auto w = only_window(path);
  const double s = w.length(), D = -3 * s;
  double bridge = 0;
  for (std::size_t r = 0; r + 1 < t.size(); ++r) {
    const double delta = t[r + 1] - t[r];
    bridge += delta * delta / 6;
  }
  CHECK(w.integral[1] == Approx(s * D / 2).epsilon(1e-13));
  CHECK(w.covariation[4] == Approx(D * D * s / 12 + bridge).epsilon(1e-12));
  CHECK(w.bridge_start[1] == Approx(s * s * D / 24).epsilon(1e-12));
  CHECK(w.bridge_end[1] == Approx(s * s * D / 24).epsilon(1e-12));
}

TEST_CASE("coarse rows give the conditional expectation of what fine rows give") {
  // Null hypothesis for Brownian Y, with 3 coarse rows of 64 fine ones: E[I_fine - I_coarse] = 0, and E C = s^2/6 +
  // sum delta^3/(12 s) for both: the second term is the variance of I given the rows, over s, which the likelihood
  // of increments asks for. 20000 draws; z threshold 5.5: two-sided false-alarm rate 4e-8 a test, 2 tests.
  constexpr std::size_t fine = 64, draws = 20000;
  double sum[2] = {}, squares[2] = {};
  std::vector<double> t(fine + 1), z(fine);
  for (std::size_t r = 0; r <= fine; ++r) t[r] = static_cast<double>(r) / fine;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    RandomStream{7, 0, static_cast<std::uint32_t>(draw), Purpose::observation_noise}.normals(0, z);
    std::vector<double> y(fine + 1, 0.0);
    for (std::size_t r = 0; r < fine; ++r) y[r + 1] = y[r] + z[r] / 8;  // sqrt(1/64)
    const auto a = path_of(t, y), b = path_of({t[0], t[16], t[64]}, {y[0], y[16], y[64]});
    const auto wf = only_window(a), wc = only_window(b);
    const double expected = (fine * std::pow(1.0 / fine, 3) - std::pow(0.25, 3) - std::pow(0.75, 3)) / 12;
    const double difference[2] = {wf.integral[0] - wc.integral[0],
                                  wf.covariation[0] - wc.covariation[0] - expected};
    for (int i = 0; i < 2; ++i) {
      sum[i] += difference[i];
      squares[i] += difference[i] * difference[i];
    }
  }
  for (int i = 0; i < 2; ++i) CHECK(std::abs(sum[i]) < 5.5 * std::sqrt(squares[i]));
}

TEST_CASE("grid points move to the nearest rows and never coincide") {
  const auto path = path_of({0, 0.1, 0.2, 0.9, 1.0}, {0, 1, 2, 3, 4});
  ObservationWindows windows(path, ObservationKind::continuous, ObservationTiming::current, 3);
  REQUIRE(windows.size() == 3);
  CHECK(windows.time(0) == 0.2);
  CHECK(windows.time(1) == 0.9);
  CHECK(windows.time(2) == 1.0);
  ObservationWindow w;
  windows.get(0, w);
  CHECK(w.rows() == 3);
  CHECK(w.increment[0] == 2.0);
  CHECK(ObservationWindows(path, ObservationKind::continuous, ObservationTiming::current, 0).size() == 4);
  CHECK_THROWS_AS(ObservationWindows(path, ObservationKind::continuous, ObservationTiming::current, 5),
                  InputError);
}

TEST_CASE("discrete observations divide their gaps and weigh where they were made") {
  const double nan = std::nan("");
  const auto path = path_of({0, 1, 3}, {nan, 1, 2});
  ObservationWindow w;
  SECTION("current: at the end of the last part") {
    ObservationWindows windows(path, ObservationKind::discrete, ObservationTiming::current, 3);
    REQUIRE(windows.size() == 3);
    windows.get(0, w);
    CHECK((w.observation == std::vector{1.0} && !w.at_start && w.end == 1));
    windows.get(1, w);
    CHECK((w.observation.empty() && w.end == 2));
    windows.get(2, w);
    CHECK((w.observation == std::vector{2.0} && w.start == 2 && w.end == 3));
  }
  SECTION("previous: at the start of the first part") {
    ObservationWindows windows(path, ObservationKind::discrete, ObservationTiming::previous, 3);
    windows.get(1, w);
    CHECK((w.observation == std::vector{2.0} && w.at_start && w.start == 1));
    windows.get(2, w);
    CHECK(w.observation.empty());
  }
  SECTION("an observation at the start is a window of length zero") {
    const auto observed = path_of({0, 1}, {5, 6});
    ObservationWindows windows(observed, ObservationKind::discrete, ObservationTiming::current, 0);
    REQUIRE(windows.size() == 2);
    windows.get(0, w);
    CHECK((w.length() == 0 && w.observation == std::vector{5.0}));
    CHECK_THROWS_AS(ObservationWindows(observed, ObservationKind::discrete, ObservationTiming::previous, 0),
                    InputError);
    CHECK_THROWS_AS(ObservationWindows(path, ObservationKind::discrete, ObservationTiming::current, 1),
                    InputError);
  }
}

TEST_CASE("times that a double does not tell apart are refused, not repeated") {
  const auto discrete = [](const ObservationPath& path, std::size_t steps) {
    return ObservationWindows(path, ObservationKind::discrete, ObservationTiming::current, steps);
  };
  CHECK_THROWS_WITH(discrete(path_of({-1e308, 1e308}, {0, 0}), 1),
                    Catch::Contains("further apart than a double"));
  CHECK_THROWS_WITH(discrete(path_of({0, 1e-320}, {0, 0}), 100),
                    Catch::Contains("row 2") && Catch::Contains("too short for"));
  CHECK_THROWS_WITH(discrete(path_of({1e15, 1e15 + 1}, {0, 0}), 100), Catch::Contains("too short for"));
  CHECK(discrete(path_of({0, 1e-320}, {0, 0}), 1).size() == 2);
  const ObservationPath late = path_of({1e9, 1e9 + 1}, {0, 0});
  const ObservationWindows windows = discrete(late, 1000);
  ObservationWindow w;
  for (std::size_t j = 1; j < windows.size(); ++j) {
    windows.get(j, w);
    CHECK(w.length() > 0);
  }
}

TEST_CASE("steps end where a coefficient jumps") {
  ObservationPath path;
  path.dimension = 1;
  for (const double t : {0.0, 1.0, 2.0, 4.0}) path.append(t, std::vector{t});
  const std::vector<double> jumps{0.25, 1, 2.5, 3, 9};
  ObservationWindow window;
  std::vector<double> ends, observed;
  for (const ObservationTiming timing : {ObservationTiming::current, ObservationTiming::previous}) {
    ObservationPath late = path;
    if (timing == ObservationTiming::previous) late.values[0] = std::numeric_limits<double>::quiet_NaN();
    const ObservationWindows windows(late, ObservationKind::discrete, timing, 4, jumps);
    ends.clear();
    observed.clear();
    for (std::size_t j = 0; j < windows.size(); ++j) {
      windows.get(j, window);
      if (window.length() == 0) continue;
      ends.push_back(window.end);
      if (!window.observation.empty()) observed.push_back(window.end);
    }
    CHECK(ends == std::vector<double>{0.25, 1, 2, 2.5, 3, 4});
    CHECK(observed == (timing == ObservationTiming::current ? std::vector<double>{1, 2, 4}
                                                            : std::vector<double>{0.25, 2, 2.5}));
  }
  // Of a path at the first row from there on.
  CHECK(rows_with_jumps({0, 3}, path.times, jumps) == std::vector<std::size_t>{0, 1, 3});
  CHECK(rows_with_jumps({0, 3}, path.times, std::vector<double>{1.5}) == std::vector<std::size_t>{0, 2, 3});
  CHECK(rows_with_jumps({0, 3}, path.times, {}) == std::vector<std::size_t>{0, 3});
}
