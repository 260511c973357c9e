/// Components with covariances: each part by the identity that defines it, the whole by exact filters and a grid.
#include "wienertree/filter/component_filter.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cstring>
#include <random>

#include "filter/linear_problems.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/filter/small_matrix.hpp"

using namespace wienertree;

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

FilterOptions components(std::size_t nodes, unsigned threads = 1) {
  FilterOptions options;
  options.conditioning = Conditioning::components;
  options.nodes = nodes;
  options.threads = threads;
  return options;
}

// N Gaussians in R^d of random means, covariances and weights.
GaussianComponents random_components(std::size_t d, std::size_t N, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  GaussianComponents c;
  c.reshape(d, N);
  const auto rows = static_cast<Eigen::Index>(d);
  for (std::size_t n = 0; n < N; ++n) {
    c.log_weight[n] = normal(engine);
    const Eigen::MatrixXd L = Eigen::MatrixXd::NullaryExpr(rows, rows, [&] { return normal(engine); });
    const Eigen::MatrixXd P = L * L.transpose();
    for (std::size_t i = 0; i < d; ++i) {
      c.mean(i, n) = normal(engine);
      for (std::size_t j = 0; j < d; ++j)
        c.covariance(i * d + j, n) = P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return c;
}

double largest_difference(const GaussianComponents& a, const GaussianComponents& b) {
  double largest = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    largest = std::max(largest, std::abs(a.log_weight[n] - b.log_weight[n]));
    for (std::size_t i = 0; i < a.mean.components(); ++i)
      largest = std::max(largest, std::abs(a.mean(i, n) - b.mean(i, n)));
    for (std::size_t i = 0; i < a.covariance.components(); ++i)
      largest = std::max(largest, std::abs(a.covariance(i, n) - b.covariance(i, n)));
  }
  return largest;
}

// A row of data every so often, with gaps of different length, a component and a whole row missing.
ObservationPath rows(std::size_t k, bool previous, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  ObservationPath path;
  path.dimension = k;
  for (const double t : {0.0, 0.3, 0.35, 1.4, 3.0, 3.1}) {
    std::vector<double> y(k);
    for (double& v : y) v = normal(engine);
    if (t == 0.35) y.back() = missing;
    if (t == 1.4) std::fill(y.begin(), y.end(), missing);
    if (t == 0 && previous) std::fill(y.begin(), y.end(), missing);
    path.append(t, y);
  }
  return path;
}

void check_against_kalman(const Model& model, const ObservationPath& path, double tolerance) {
  KalmanFilter exact(model);
  const auto filter = make_filter(model, components(50));
  const ObservationWindows windows(path, model.observation, model.timing, 0);
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, window);
    exact.advance(window);
    filter->advance(window);
    const Posterior &p = filter->posterior(), &q = exact.posterior();
    CHECK(p.size() == 1);
    CHECK(p.log_evidence == Approx(q.log_evidence).epsilon(tolerance).margin(tolerance));
    CHECK((mean_of(p) - mean_of(q)).norm() < tolerance * (1 + mean_of(q).norm()));
    CHECK((covariance_of(p) - covariance_of(q)).norm() < tolerance * (1 + covariance_of(q).norm()));
  }
  for (const FilterWarning& w : filter->warnings()) CHECK(w.kind == WarningKind::out_of_reach);
}

Model double_well(const std::string& observation) {
  return parse_model(
      "name = \"wells\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\nz = { initial = 0 }\n[drift]\n"
      "x = \"x - x^3 + z\"\nz = \"-z\"\n[diffusion]\nx = [0.45, 0.0]\nz = [0.1, 0.3]\n"
      "[initial]\nmean = [0.0, 0.0]\ncovariance = [[0.3, 0.0], [0.0, 0.05]]\n[observation]\nkind = "
      "\"discrete\"\n" +
          observation,
      "wells.toml", {});
}

}  // namespace

TEST_CASE("components of affine signals: one, which is the Kalman filter's") {
  unsigned seed = 10;
  for (const Eigen::Index d : {2, 3, 4, 5, 6, 7, 8})
    for (const bool previous : {false, true})
      for (const bool random_start : {false, true}) {
        const LinearProblem l(d, d < 4 ? 1 : 3, 2, ++seed);
        const Model model = l.model(
            std::string("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 0.3 }\ntiming = \"") +
                (previous ? "previous" : "current") + "\"",
            random_start);
        INFO("d = " << d << ", previous " << previous << ", random start " << random_start);
        check_against_kalman(model, rows(2, previous, seed), 1e-9);
      }
}

TEST_CASE("components of affine signals: vague and diffuse starts, noise in one of two states") {
  const char* text =
      "name = \"track\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\nv = { initial = 0 }\n[drift]\n"
      "x = \"v\"\nv = \"0\"\n[diffusion]\nx = [0]\nv = [0.3]\n[initial]\nmean = [0, 0]\ncovariance = [[1, "
      "0], "
      "[0, 1]]\n[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.01 }\n";
  for (const double variance : {1.0, 1e6}) {
    Model model = parse_model(text, "track.toml", {});
    model.initial_law->covariance = variance * Eigen::Matrix2d::Identity();
    // Variances of 1e6 and 1e-4 side by side leave ten digits of sixteen.
    check_against_kalman(model, rows(1, false, 3), variance > 1 ? 1e-5 : 1e-9);
  }
}

TEST_CASE("components: a drift that depends on the time is affine, and the clock is no state") {
  const auto model = [](const char* drift) {
    return parse_model(std::string("name = \"season\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.5 }\n"
                                   "z = { initial = 0 }\n[drift]\nx = \"") +
                           drift +
                           "\"\nz = \"x - z\"\n[diffusion]\nx = [0.4]\nz = [0.2]\n[observation]\nkind = "
                           "\"discrete\"\nh = [\"z\"]\nnoise = { law = \"gaussian\", sd = 0.2 }\n",
                       "season.toml", {});
  };
  // x' = -x + 2 t has the particular solution 2 t - 2: with u = x - 2 t + 2 the model is one without a clock.
  const Model clock = model("-x + 2*t");
  REQUIRE(clock.has_clock);
  const Model seasonal = model("-x + 2*t + 1e-14*sin(t)");  // not known to be affine: by the moment equations
  ObservationPath path = rows(1, false, 8);
  const auto a = make_filter(clock, components(50)), b = make_filter(seasonal, components(50));
  run(*a, ObservationWindows(path, clock.observation, clock.timing, 0), {});
  run(*b, ObservationWindows(path, clock.observation, clock.timing, 0), {});
  // Runge-Kutta of order 4 with |J| h below .1: .1^4/120 a unit of time, relative.
  CHECK(a->posterior().size() == 1);
  CHECK(b->posterior().size() == 1);
  CHECK(a->posterior().log_evidence == Approx(b->posterior().log_evidence).epsilon(1e-5));
  CHECK(mean(a->posterior(), 0) == Approx(mean(b->posterior(), 0)).margin(1e-5));
  // The clock is the last component of points, without variance.
  CHECK(a->posterior().points(2, 0) == Approx(3.1));
  CHECK(covariance(a->posterior(), 2, 2) == 0);
}

TEST_CASE("tilts: what is multiplied and divided out again is as it was") {
  for (const std::size_t d : {2U, 3U, 5U}) {
    const GaussianComponents before = random_components(d, 100, 5);
    GaussianComponents c = before;
    const GaussianComponents other = random_components(d, 1, 6);
    Tilt h = Tilt::none(d);
    for (std::size_t i = 0; i < d; ++i) {
      h.f(static_cast<Eigen::Index>(i)) = other.mean(i, 0);
      h.centre(static_cast<Eigen::Index>(i)) = 0.3;
      for (std::size_t j = 0; j < d; ++j)
        h.H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            0.05 * other.covariance(i * d + j, 0);
    }
    multiply(c, h, nullptr);
    CHECK(largest_difference(c, before) > 0.1);
    std::vector<std::uint32_t> wide;
    divide(c, h, wide, nullptr);
    CHECK(wide.empty());
    CHECK(largest_difference(c, before) < 1e-10);
  }
}

TEST_CASE("tilts: the factor is the integral of h under the Gaussian") {
  // d = 2, by Gauss and Hermite's rule of 40^2 points: h is entire, and varies over one standard deviation.
  GaussianComponents c = random_components(2, 1, 11);
  c.log_weight[0] = 0;
  Tilt h = Tilt::none(2);
  h.H << 0.5, 0.1, 0.1, 0.3;
  h.f << 0.4, -0.2;
  h.centre << 0.1, 0.2;
  const GaussianCubature rule = gauss_hermite(2, 40);
  Eigen::Matrix2d P;
  P << c.covariance(0, 0), c.covariance(1, 0), c.covariance(2, 0), c.covariance(3, 0);
  const Eigen::Matrix2d L = P.llt().matrixL();
  const Eigen::Vector2d m(c.mean(0, 0), c.mean(1, 0));
  double mass = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  for (Eigen::Index q = 0; q < rule.weights.size(); ++q) {
    const Eigen::Vector2d x = m + L * rule.points.col(q), u = x - h.centre;
    const double w = rule.weights(q) * std::exp(h.f.dot(u) - 0.5 * u.dot(h.H * u));
    mass += w;
    first += w * x;
  }
  multiply(c, h, nullptr);
  CHECK(c.log_weight[0] == Approx(std::log(mass)).margin(1e-9));
  CHECK(c.mean(0, 0) == Approx(first(0) / mass).margin(1e-8));
  CHECK(c.mean(1, 0) == Approx(first(1) / mass).margin(1e-8));
}

TEST_CASE("splitting and merging keep mass, mean and covariance, and narrow what they split") {
  for (const std::size_t d : {2U, 4U, 6U}) {
    const GaussianComponents before = random_components(d, 40, 21);
    const MixtureMoments law = moments(before);
    GaussianComponents children;
    ComponentSplit split;
    split.split(before, law.covariance, 0.3, 0, 0, children, nullptr);
    CHECK(children.size() > 40);
    const auto close = [&](const MixtureMoments& other) {
      CHECK(other.log_mass == Approx(law.log_mass).margin(1e-12));
      CHECK((other.mean - law.mean).norm() < 1e-12 * (1 + law.mean.norm()) * 10);
      CHECK((other.covariance - law.covariance).norm() < 1e-11 * law.covariance.norm());
    };
    close(moments(children));
    const Whitening<Eigen::Dynamic> white{SmallSquare<Eigen::Dynamic>(law.covariance)};
    double widest = 0;
    for (std::size_t n = 0; n < before.size(); ++n) {
      const auto P = square_of<Eigen::Dynamic>(before.covariance, d, n);
      const SmallSquare<Eigen::Dynamic> inside = white.whitening * P * white.whitening.transpose();
      widest = std::max(widest, SymmetricEigen<Eigen::Dynamic>(inside).values.maxCoeff());
    }
    // As few parts as there can be, three in each direction, narrow a variance to 1/(1 + (2.4 * 1.6/1.7321)^2) of it.
    const double narrowest = widest / (1 + std::pow(2.4 * 1.6 / 1.7321, 2));
    for (std::size_t n = 0; n < children.size(); n += 17) {
      const auto P = square_of<Eigen::Dynamic>(children.covariance, d, n);
      const SmallSquare<Eigen::Dynamic> inside = white.whitening * P * white.whitening.transpose();
      const SymmetricEigen<Eigen::Dynamic> eigen(inside);
      CHECK(eigen.values.maxCoeff() < std::max(1.02 * 0.09, narrowest) + 1e-10);
      CHECK(eigen.values.minCoeff() > -1e-10);
    }
    ComponentMerge merge;
    merge.merge(children, 25);
    CHECK(children.size() <= 25);
    CHECK(children.size() >= 20);
    close(moments(children));
  }
}

TEST_CASE("components: a nonlinear sensor of a Gaussian is conditioned as by a fine rule") {
  // y = x^2 + noise given x ~ N(0, .3), z independent: two modes, which a single Gaussian cannot show. Reference by
  // the trapezoidal rule on 4001 points of [-6, 6] sd, where it converges geometrically.
  const Model model = double_well("h = [\"x^2\"]\nnoise = { law = \"gaussian\", sd = 0.15 }\n");
  const ObservationPath path{1, {0.0}, {0.6}};
  const auto filter = make_filter(model, components(200));
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  double mass = 0, second = 0;
  const double sd = std::sqrt(0.3), spacing = 12 * sd / 4000;
  for (int i = 0; i <= 4000; ++i) {
    const double x = -6 * sd + i * spacing, r = (0.6 - x * x) / 0.15;
    const double w = spacing * std::exp(-x * x / 0.6 - r * r / 2) / (sd * 0.15 * 2 * 3.14159265358979324);
    mass += w;
    second += w * x * x;
  }
  CHECK(filter->posterior().log_evidence == Approx(std::log(mass)).margin(0.02));
  CHECK(mean(filter->posterior(), 0) == Approx(0).margin(0.02));
  CHECK(covariance(filter->posterior(), 0, 0) == Approx(second / mass).epsilon(0.02));
}

TEST_CASE("components: the same bytes for any number of threads, and after a checkpoint", "[threads]") {
  const Model model = double_well("h = [\"x\"]\nnoise = { law = \"student-t\", dof = 3, scale = 0.3 }\n");
  const Simulation drawn = simulate(model, 1.5, 300, 5, 5);
  const ObservationWindows windows(drawn.observations, model.observation, model.timing, 0);
  auto one = make_filter(model, components(80)), three = make_filter(model, components(80, 3));
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, window);
    one->advance(window);
    three->advance(window);
    const Posterior &p = one->posterior(), &q = three->posterior();
    REQUIRE(p.size() == q.size());
    CHECK(std::memcmp(&p.log_evidence, &q.log_evidence, sizeof(double)) == 0);
    for (std::size_t i = 0; i < 2; ++i)
      CHECK(std::memcmp(p.points.component(i).data(), q.points.component(i).data(),
                        p.size() * sizeof(double)) == 0);
    if (j != 2) continue;
    StateArchive state;
    three->exchange(state);
    const std::string bytes = state.bytes();
    three = make_filter(model, components(80, 2));
    StateArchive back(bytes);
    three->exchange(back);
    back.finish();
  }
}

TEST_CASE("components: options that do not fit are refused") {
  const Model wells = double_well("h = [\"x\"]\nnoise = { law = \"gaussian\", sd = 1 }\n");
  CHECK_THROWS_AS(make_filter(wells, components(0)), InputError);
  const LinearProblem line(1, 1, 1, 4);
  CHECK_THROWS_AS(
      make_filter(line.model("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1 }", false),
                  components(10)),
      InputError);
  const LinearProblem two(2, 1, 1, 4);
  CHECK_THROWS_AS(make_filter(two.model("kind = \"continuous\"", false), components(10)), InputError);
}
