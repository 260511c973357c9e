/// The Kalman filter against the joint Gaussian law of all observations, and on the Nile.
#include "wienertree/filter/kalman_filter.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "filter/linear_problems.hpp"
#include "wienertree/filter/observations.hpp"

using namespace wienertree;

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

// int_0^s exp(A u) M exp(A u)^T du by Simpson's rule on n = 4000 intervals, error (|A| s/n)^4 s/180.
Eigen::MatrixXd accumulated(const Eigen::MatrixXd& A, const Eigen::MatrixXd& M, double s) {
  constexpr int n = 4000;
  const Eigen::MatrixXd step = (A * (s / n)).exp();
  Eigen::MatrixXd F = Eigen::MatrixXd::Identity(A.rows(), A.rows()),
                  sum = Eigen::MatrixXd::Zero(A.rows(), A.rows());
  for (int i = 0; i <= n; ++i, F = F * step)
    sum += (i == 0 || i == n ? 1.0 : i % 2 ? 4.0 : 2.0) * F * M * F.transpose();
  return sum * s / (3.0 * n);
}

struct JointGaussian {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

// The joint law of the states at all times, X = (X_0, X_1, ..), from X_{r+1} = F X_r + f + noise.
JointGaussian states(const LinearProblem& l, const std::vector<double>& times, bool random_start) {
  const Eigen::Index d = l.A.rows(), n = static_cast<Eigen::Index>(times.size());
  JointGaussian j{Eigen::VectorXd::Zero(d * n), Eigen::MatrixXd::Zero(d * n, d * n)};
  j.mean.head(d) = l.start;
  if (random_start) j.covariance.topLeftCorner(d, d) = l.start_covariance;
  for (Eigen::Index r = 1; r < n; ++r) {
    const double s = times[static_cast<std::size_t>(r)] - times[static_cast<std::size_t>(r) - 1];
    const Eigen::MatrixXd F = (l.A * s).exp();
    j.mean.segment(r * d, d) =
        F * j.mean.segment((r - 1) * d, d) + l.A.inverse() * (F - Eigen::MatrixXd::Identity(d, d)) * l.a;
    j.covariance.block(r * d, 0, d, r * d) = F * j.covariance.block((r - 1) * d, 0, d, r * d);
    j.covariance.block(0, r * d, r * d, d) = j.covariance.block(r * d, 0, d, r * d).transpose();
    j.covariance.block(r * d, r * d, d, d) =
        F * j.covariance.block((r - 1) * d, (r - 1) * d, d, d) * F.transpose() +
        accumulated(l.A, l.B * l.B.transpose(), s);
  }
  return j;
}

struct Answer {
  double log_likelihood;
  Eigen::VectorXd mean;  // of the last state
  Eigen::MatrixXd covariance;
};

// Conditions the joint law on all components present at once. Row r sees state r, or r-1 under "previous".
Answer brute_force(const LinearProblem& l, const ObservationPath& path, bool previous, double variance,
                   bool random_start) {
  const JointGaussian X = states(l, path.times, random_start);
  const Eigen::Index d = l.A.rows(), k = l.H.rows(), n = static_cast<Eigen::Index>(path.rows());
  std::vector<std::pair<Eigen::Index, Eigen::Index>> present;
  for (Eigen::Index r = 0; r < n; ++r)
    for (Eigen::Index i = 0; i < k; ++i)
      if (!std::isnan(path.row(static_cast<std::size_t>(r))[static_cast<std::size_t>(i)]))
        present.emplace_back(r, i);
  const auto count = static_cast<Eigen::Index>(present.size());
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(count, d * n);
  Eigen::VectorXd e(count);
  for (Eigen::Index o = 0; o < count; ++o) {
    const auto [r, i] = present[static_cast<std::size_t>(o)];
    G.block(o, (previous ? r - 1 : r) * d, 1, d) = l.H.row(i);
    e(o) = path.row(static_cast<std::size_t>(r))[static_cast<std::size_t>(i)] - l.c(i);
  }
  e -= G * X.mean;
  const Eigen::MatrixXd S =
      G * X.covariance * G.transpose() + variance * Eigen::MatrixXd::Identity(count, count);
  const Eigen::LDLT<Eigen::MatrixXd> solver(S);
  const Eigen::MatrixXd cross = X.covariance.bottomRows(d) * G.transpose();
  const double log_determinant = solver.vectorD().array().log().sum();
  return {-(static_cast<double>(count) * std::log(2 * std::numbers::pi) + log_determinant +
            e.dot(solver.solve(e))) /
              2,
          X.mean.tail(d) + cross * solver.solve(e),
          X.covariance.bottomRightCorner(d, d) - cross * solver.solve(cross.transpose())};
}

ObservationPath irregular_rows(Eigen::Index k, bool previous, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  ObservationPath path;
  path.dimension = static_cast<std::size_t>(k);
  for (const double t : {0.0, 0.3, 0.35, 1.4, 3.0, 3.1}) {
    std::vector<double> y(path.dimension);
    for (double& v : y) v = normal(engine);
    if (t == 0.35) y.back() = missing;                     // a component
    if (t == 1.4) std::fill(y.begin(), y.end(), missing);  // a whole row
    if (t == 0 && previous) std::fill(y.begin(), y.end(), missing);
    path.append(t, y);
  }
  return path;
}

}  // namespace

TEST_CASE("Kalman filter: likelihood and posterior are those of the joint Gaussian law") {
  unsigned seed = 1;
  for (const Eigen::Index d : {1, 2, 4})
    for (const bool previous : {false, true})
      for (const bool random_start : {false, true}) {
        const LinearProblem l(d, 2, 2, ++seed);
        const Model model =
            l.model(std::string("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 0.7 }\n") +
                        "timing = \"" + (previous ? "previous" : "current") + "\"",
                    random_start);
        const ObservationPath path = irregular_rows(2, previous, seed);
        const Answer exact = brute_force(l, path, previous, 0.49, random_start);
        for (const std::size_t steps : {0, 40}) {
          KalmanFilter filter(model);
          run(filter, ObservationWindows(path, model.observation, model.timing, steps), {});
          const Posterior& p = filter.posterior();
          INFO("d = " << d << ", previous " << previous << ", random start " << random_start << ", steps "
                      << steps);
          // Simpson's rule above is right to (3 * 1.6/4000)^4/180 = 1e-14; both lose a few digits to
          // rounding.
          CHECK(p.log_evidence == Approx(exact.log_likelihood).epsilon(1e-10));
          CHECK((mean_of(p) - exact.mean).norm() < 1e-10);
          CHECK((covariance_of(p) - exact.covariance).norm() < 1e-10);
        }
      }
}

TEST_CASE(
    "linear transition: a long step is many short ones, and reaches the stationary law of a stiff system") {
  LinearProblem l(3, 2, 1, 5);
  l.A -= 2 * Eigen::MatrixXd::Identity(3, 3);
  LinearGaussianModel model = linear_gaussian_model(l.model("", false));
  const LinearTransition half = linear_transition(model, 0.35), whole = linear_transition(model, 0.7);
  CHECK((half.F * half.F - whole.F).norm() < 1e-14);
  CHECK((half.F * half.f + half.f - whole.f).norm() < 1e-14);
  CHECK((half.F * half.Q * half.F.transpose() + half.Q - whole.Q).norm() < 1e-14);
  // A P + P A^T + Q = 0 in the limit; rates 1e3 and 1 side by side, over a time of 100.
  model.A.row(0) *= 1e3;
  const LinearTransition limit = linear_transition(model, 100);
  const Eigen::MatrixXd residual = model.A * limit.Q + limit.Q * model.A.transpose() + model.Q;
  CHECK(residual.norm() < 1e-10 * model.A.norm() * limit.Q.norm());
  CHECK(limit.F.norm() < 1e-10);
}

TEST_CASE("Kalman filter: the Nile's local level") {
  // Reference: the log-likelihood of Durbin, Koopman (2012), section 2.2, with the proper prior N(0, 1e7),
  // recomputed independently.
  const std::string root = std::string(WIENERTREE_SOURCE_DIR) + "/data/";
  const Model model = load_model(root + "models/nile.toml");
  const auto path = read_observations(root + "observations/nile.csv", 1, ObservationKind::discrete);
  FilterOptions options;
  options.method = FilterMethod::kalman;
  const auto filter = make_filter(model, options);
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  const Posterior& p = filter->posterior();
  CHECK(p.log_evidence == Approx(-641.585578).margin(1e-6));
  CHECK(mean(p, 0) == Approx(798.36911).margin(1e-5));
  CHECK(covariance(p, 0, 0) == Approx(4032.08089).margin(1e-5));
}

TEST_CASE("Kalman filter: a vague prior of variance 1e14 leaves the posterior of the data alone") {
  LinearProblem l(1, 1, 1, 3);
  l.H(0, 0) = 1;
  l.c(0) = 0;
  Model model = l.model("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 0.5 }", true);
  model.initial_law->covariance(0, 0) = 1e14;
  ObservationPath path{1, {0.0}, {2.0}};
  KalmanFilter filter(model);
  run(filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  // P_1 = 1/(1/0.25 + 1e-14); I - K h is 1 - K = 2.5e-15, itself a difference of numbers of size 1, but
  // K R K is not.
  CHECK(mean(filter.posterior(), 0) == Approx(2.0));
  CHECK(covariance(filter.posterior(), 0, 0) == Approx(0.25).epsilon(1e-12));
}

TEST_CASE("Kalman filter: models that are not linear and Gaussian are refused, saying why") {
  const auto refuses = [](const Model& m, const char* why) {
    CHECK_THROWS_WITH(KalmanFilter(m), Catch::Contains(why));
    CHECK_THROWS_AS(KalmanFilter(m), InputError);
  };
  const LinearProblem l(1, 1, 1, 9);
  refuses(l.model("kind = \"continuous\"", false), "kalman-bucy");
  refuses(l.model("kind = \"discrete\"\nnoise = { law = \"laplace\", scale = 1 }", false), "Gaussian");
  const auto scalar = [](const char* drift, const char* diffusion, const char* h, const char* bound) {
    return parse_model(
        fmt::format("name = \"m\"\nconvention = \"ito\"\n[state]\nx = {{ initial = 1{} }}\n[drift]\n"
                    "x = \"{}\"\n[diffusion]\nx = [\"{}\"]\n[observation]\nkind = \"discrete\"\n"
                    "h = [\"{}\"]\nnoise = {{ law = \"gaussian\", sd = 1 }}\n",
                    bound, drift, diffusion, h),
        "m.toml", {});
  };
  refuses(scalar("-x^3", "1", "x", ""), "drift");
  refuses(scalar("-x", "x", "x", ""), "diffusion");
  refuses(scalar("-x", "1", "x^2", ""), "sensor");
  refuses(scalar("-x", "1", "x", ", lower = 0"), "bounded");
}

TEST_CASE("Kalman filter: an observation that is not finite is an error with its place") {
  const LinearProblem l(1, 1, 1, 9);
  const Model model = l.model("kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1 }", false);
  ObservationPath path{1, {0.0, 1.0}, {0.0, std::numeric_limits<double>::infinity()}};
  KalmanFilter filter(model);
  CHECK_THROWS_WITH(run(filter, ObservationWindows(path, model.observation, model.timing, 0), {}),
                    Catch::Contains("t = 1") && Catch::Contains("y1 = inf"));
}
