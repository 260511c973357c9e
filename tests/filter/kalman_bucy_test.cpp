/// linear-3d (d = 3, p = 2, k = 2) against a Kalman-Bucy recursion written for this test.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <numeric>
#include <unsupported/Eigen/MatrixFunctions>

#include "filter/text_problems.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/kalman_bucy_filter.hpp"

using namespace wienertree;

namespace {

struct KalmanBucy {
  Eigen::VectorXd m;
  Eigen::MatrixXd P;
  double log_evidence = 0;
};

// dm = (A m + a) dt + P H' (dY - (H m + c) dt), P' = A P + P A' + B B' - P H' H P: Euler for m and Heun for P
// on each row.
KalmanBucy kalman_bucy(const Model& model, const ObservationPath& path) {
  const AffineFields& V = *model.fields->affine_fields();
  const AffineSensor& h = *model.fields->affine_sensor();
  const auto d = static_cast<Eigen::Index>(model.state_dimension());
  Eigen::MatrixXd Q = Eigen::MatrixXd::Zero(d, d);
  for (std::size_t j = 1; j < V.constant.size(); ++j) Q += V.constant[j] * V.constant[j].transpose();
  const Eigen::MatrixXd &A = V.linear[0], &H = h.linear;
  const auto riccati = [&](const Eigen::MatrixXd& P) -> Eigen::MatrixXd {
    return A * P + P * A.transpose() + Q - P * H.transpose() * H * P;
  };
  KalmanBucy f{Eigen::Map<const Eigen::VectorXd>(model.initial.data(), d), Eigen::MatrixXd::Zero(d, d)};
  for (std::size_t r = 0; r + 1 < path.rows(); ++r) {
    const double dt = path.times[r + 1] - path.times[r];
    const Eigen::Map<const Eigen::VectorXd> a(path.row(r).data(), H.rows()),
        b(path.row(r + 1).data(), H.rows());
    const Eigen::VectorXd predicted = H * f.m + h.constant;
    f.log_evidence += predicted.dot(b - a) - predicted.squaredNorm() / 2 * dt;
    f.m += (A * f.m + V.constant[0]) * dt + f.P * H.transpose() * (b - a - predicted * dt);
    const Eigen::MatrixXd k1 = riccati(f.P);
    f.P += dt / 2 * (k1 + riccati(f.P + dt * k1));
  }
  return f;
}

// log of the density of the rows' increments of Y, over that of Brownian increments: the Kalman filter of (X, J), J the
// integral of h over the gap, whose mean and covariance over a gap are those of van Loan (1978).
double log_evidence_of_increments(const Model& model, const ObservationPath& path) {
  const AffineFields& V = *model.fields->affine_fields();
  const AffineSensor& h = *model.fields->affine_sensor();
  const auto d = static_cast<Eigen::Index>(model.state_dimension()), k = h.linear.rows(), n = d + k;
  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(n + 1, n + 1), Q = Eigen::MatrixXd::Zero(n, n);  // (X, J, 1)
  F.topLeftCorner(d, d) = V.linear[0];
  F.block(d, 0, k, d) = h.linear;
  F.block(0, n, d, 1) = V.constant[0];
  F.block(d, n, k, 1) = h.constant;
  for (std::size_t j = 1; j < V.constant.size(); ++j)
    Q.topLeftCorner(d, d) += V.constant[j] * V.constant[j].transpose();
  Eigen::VectorXd m = Eigen::Map<const Eigen::VectorXd>(model.initial.data(), d);
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(d, d);
  double sum = 0;
  for (std::size_t r = 0; r + 1 < path.rows(); ++r) {
    const double dt = path.times[r + 1] - path.times[r];
    Eigen::MatrixXd loan = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    loan.topLeftCorner(n, n) = -F.topLeftCorner(n, n) * dt;
    loan.topRightCorner(n, n) = Q * dt;
    loan.bottomRightCorner(n, n) = F.topLeftCorner(n, n).transpose() * dt;
    const Eigen::MatrixXd e = loan.exp(), flow = (F * dt).exp();
    const Eigen::MatrixXd A = e.bottomRightCorner(n, n).transpose(), N = A * e.topRightCorner(n, n);
    Eigen::VectorXd z = Eigen::VectorXd::Zero(n);
    z.head(d) = m;
    z = A * z + flow.topRightCorner(n, 1);
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(n, n);
    C.topLeftCorner(d, d) = P;
    C = A * C * A.transpose() + N;
    const Eigen::Map<const Eigen::VectorXd> a(path.row(r).data(), k), b(path.row(r + 1).data(), k);
    const Eigen::VectorXd D = b - a, residual = D - z.tail(k);
    const Eigen::MatrixXd S = C.bottomRightCorner(k, k) + dt * Eigen::MatrixXd::Identity(k, k),
                          gain = C.topRightCorner(d, k) * S.inverse();
    sum += -0.5 * residual.dot(S.inverse() * residual) - 0.5 * std::log((S / dt).determinant()) +
           0.5 * D.squaredNorm() / dt;
    m = z.head(d) + gain * residual;
    P = C.topLeftCorner(d, d) - gain * S * gain.transpose();
  }
  return sum;
}

}  // namespace

TEST_CASE("the evidence is that of the rows' increments, however far apart the rows") {
  const Model model = load_model(std::string(WIENERTREE_SOURCE_DIR) + "/data/models/linear-3d.toml", {});
  const auto fine = simulate(model, 5, 4000, 4000, 11).observations;
  // Of the first order of the rows' spacing nothing is left: what is left falls by 4 from spacing to spacing.
  std::vector<double> left;
  for (const std::size_t every : {80, 40, 20}) {
    ObservationPath path;
    path.dimension = fine.dimension;
    for (std::size_t r = 0; r < fine.rows(); r += every) path.append(fine.times[r], fine.row(r));
    const double exact = log_evidence_of_increments(model, path);
    const auto of = [&](bool linear) {
      KalmanBucyFilter filter(model);
      std::vector<std::size_t> rows(path.rows());
      std::iota(rows.begin(), rows.end(), std::size_t{0});
      run(filter, ObservationWindows(path, rows, linear), {});
      return filter.posterior().log_evidence;
    };
    left.push_back(std::abs(of(false) - exact));
    INFO(path.rows() << " rows: " << left.back() << " of " << std::abs(of(true) - exact));
    CHECK(left.back() < 0.1 * std::abs(of(true) - exact));
  }
  CHECK(left[1] < left[0] / 3);
  CHECK(left[2] < left[1] / 3);
}

TEST_CASE("linear-3d: the KLV filter agrees with Kalman-Bucy within its stated error") {
  const Model model = load_model(std::string(WIENERTREE_SOURCE_DIR) + "/data/models/linear-3d.toml", {});
  REQUIRE(model.state_dimension() == 3);
  REQUIRE(model.noise_dimension() == 2);
  REQUIRE(model.fields->sensor_dimension() == 2);
  const auto path = simulate(model, 5, 100'000, 100'000, 4).observations;
  const KalmanBucy exact = kalman_bucy(model, path);
  for (const auto order : {SiteOrder::tree, SiteOrder::spatial}) {
    // The stated error: the standard deviation over launches, plus the discretisation error seen by halving
    // the steps.
    constexpr unsigned launches = 6;
    Eigen::Vector3d coarse = Eigen::Vector3d::Zero(), fine = coarse, squares = coarse;
    double evidence = 0;
    for (unsigned l = 0; l < launches; ++l)
      for (const std::size_t n : {25, 50}) {
        FilterOptions o;
        o.formula = construct_ninomiya_victoir(2);
        o.nodes = 2000;
        o.thinning = {ThinningMethod::tbba, order, 0};
        o.launch = l;
        const auto filter = make_filter(model, o);
        run(*filter, ObservationWindows(path, model.observation, model.timing, n), {});
        for (int i = 0; i < 3; ++i) {
          const double m = mean(filter->posterior(), static_cast<std::size_t>(i)) / launches;
          (n == 25 ? coarse : fine)(i) += m;
          if (n == 50) squares(i) += m * m * launches;
        }
        if (n == 50) evidence += filter->posterior().log_evidence / launches;
      }
    for (int i = 0; i < 3; ++i) {
      const double sd = std::sqrt(std::max(0.0, squares(i) - fine(i) * fine(i)) / (launches - 1));
      const double stated = std::abs(fine(i) - coarse(i)) + 8 * sd + 2e-3;
      INFO("state " << i << ": exact " << exact.m(i) << ", KLV " << fine(i) << " +- " << stated);
      CHECK(fine(i) == Approx(exact.m(i)).margin(stated));
      CHECK(stated < 0.2);
    }
    CHECK(evidence == Approx(exact.log_evidence).margin(0.1));
  }
}
