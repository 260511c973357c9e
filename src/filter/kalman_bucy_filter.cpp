#include "wienertree/filter/kalman_bucy_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace wienertree {
namespace {

const double root15 = std::sqrt(15.0);
const std::array<double, 3> node = {0.5 - root15 / 10, 0.5, 0.5 + root15 / 10};
constexpr std::array<double, 3> weight = {5.0 / 18, 4.0 / 9, 5.0 / 18};
const double gauss[3][3] = {{5.0 / 36, 2.0 / 9 - root15 / 15, 5.0 / 36 - root15 / 30},
                            {5.0 / 36 + root15 / 24, 2.0 / 9, 5.0 / 36 - root15 / 24},
                            {5.0 / 36 + root15 / 30, 2.0 / 9 + root15 / 15, 5.0 / 36}};
constexpr double longest_step = 0.1;  // in units of 1/|F|

double norm_1(const Eigen::MatrixXd& M) {
  return M.size() == 0 ? 0.0 : M.cwiseAbs().colwise().sum().maxCoeff();
}

}  // namespace

KalmanBucyFilter::KalmanBucyFilter(const Model& model)
    : model_(linear_gaussian_model(model)), observed_(model.observation == ObservationKind::continuous) {
  if (model.observation == ObservationKind::discrete)
    throw InputError("the Kalman-Bucy filter takes continuous observations; for discrete ones use kalman",
                     "model " + model.name);
  const Eigen::Index d = model_.A.rows();
  m_ = model_.mean;
  P_ = model_.covariance;
  slopes_.resize(3 * d);
  stage_trace_.resize(3);
  system_.resize(3 * d, 3 * d);
}

void KalmanBucyFilter::advance(const ObservationWindow& window) {
  const auto k = static_cast<std::size_t>(model_.H.rows());
  if (!riccati_) start_riccati(observed_ ? window.row_times[1] - window.row_times[0] : window.length());
  if (observed_)
    for (std::size_t r = 0; r + 1 < window.rows(); ++r) {
      const double length = window.row_times[r + 1] - window.row_times[r];
      const auto row = [&](std::size_t n) {
        return Eigen::Map<const Eigen::VectorXd>(window.row_values.data() + n * k, model_.H.rows());
      };
      increment_ = (row(r + 1) - row(r)) / length;
      pass_gap(length, increment_);
    }
  // What the increments' likelihood has beyond that of the path that is linear between rows.
  if (observed_) log_evidence_ += (model_.H * model_.Q * model_.H.transpose()).trace() * window.bridge / 2;
  if (!observed_) pass_gap(window.length(), increment_);
  posterior_.time = window.end;
  ++statistics_.steps;
}

void KalmanBucyFilter::start_riccati(double tau) {
  riccati_tau_ = tau;
  riccati_.emplace(model_.A, model_.Q, model_.H, model_.covariance, tau);
}

void KalmanBucyFilter::riccati_at(double t, Eigen::MatrixXd& P) {
  if (!first_riccati_at_) first_riccati_at_ = t;
  riccati_->at(t, P);
}

// CVODE's own steps depend on the equation and on the first time it is read at, on no later one: integrated
// again from the start it is where it was.
void KalmanBucyFilter::exchange_state(StateArchive& archive) {
  archive(elapsed_, m_, P_, log_evidence_, posterior_.time, riccati_tau_, first_riccati_at_);
  const Eigen::Index d = model_.A.rows();
  StateArchive::require(m_.size() == d && P_.rows() == d && P_.cols() == d);
  if (!archive.reading()) return;
  riccati_.reset();
  if (!first_riccati_at_) return;
  start_riccati(riccati_tau_);
  riccati_->at(*first_riccati_at_, stage_P_);
  riccati_->at(elapsed_, stage_P_);
}

// A bound for |F| on the step to come, F = A - P H^T H: P may grow towards its equilibrium, where
// P H^T H is of the size of sqrt(|Q| |H^T H|).
double KalmanBucyFilter::rate() const {
  return norm_1(model_.A) + norm_1(P_ * model_.H.transpose() * model_.H) +
         std::sqrt(norm_1(model_.Q) * norm_1(model_.H.transpose() * model_.H));
}

void KalmanBucyFilter::pass_gap(double length, const Eigen::VectorXd& slope) {
  // The first steps from a vague start may be very short; a time scale that stays so would take for ever.
  constexpr int most_steps = 1'000'000;
  const double start = elapsed_;
  int steps = 0;
  for (double passed = 0; passed < length; ++steps) {
    const double rest = length - passed, parts = std::ceil(rest * rate() / longest_step);
    const double s = parts > 1 ? rest / parts : rest;
    if (steps == most_steps || (parts > 1 && !(passed + s > passed)))
      throw RunError("the filter's own time scale is too short for the gap between two rows",
                     fmt::format("t = {:g} after the start", elapsed_), fmt::format("steps of {:g}", s));
    gauss_step(s, slope);
    passed = parts > 1 ? passed + s : length;
    elapsed_ = start + passed;
  }
}

// On the stages P_i, with F_i = A - P_i H^T H:  K_i = F_i (m + s sum_j a_ij K_j) + a + P_i H^T (Y' - c).
void KalmanBucyFilter::gauss_step(double s, const Eigen::VectorXd& slope) {
  const Eigen::Index d = m_.size();
  const auto& H = model_.H;
  system_.setIdentity();
  for (Eigen::Index i = 0; i < 3; ++i) {
    riccati_at(elapsed_ + node[static_cast<std::size_t>(i)] * s, stage_P_);
    gain_.noalias() = stage_P_ * H.transpose();
    drift_ = model_.A;
    drift_.noalias() -= gain_ * H;
    for (Eigen::Index j = 0; j < 3; ++j) system_.block(i * d, j * d, d, d) -= s * gauss[i][j] * drift_;
    slopes_.segment(i * d, d) = drift_ * m_ + model_.a;
    if (observed_) slopes_.segment(i * d, d) += gain_ * (slope - model_.c);
    stage_trace_(i) = observed_ ? (H * gain_).trace() : 0.0;
  }
  lu_.compute(system_);
  slopes_ = lu_.solve(slopes_).eval();
  for (Eigen::Index i = 0; i < 3 && observed_; ++i) {
    stage_m_ = m_;
    for (Eigen::Index j = 0; j < 3; ++j) stage_m_ += s * gauss[i][j] * slopes_.segment(j * d, d);
    sensor_ = H * stage_m_ + model_.c;
    log_evidence_ += s * weight[static_cast<std::size_t>(i)] *
                     (sensor_.dot(slope) - sensor_.squaredNorm() / 2 - stage_trace_(i) / 2);
  }
  for (Eigen::Index j = 0; j < 3; ++j)
    m_ += s * weight[static_cast<std::size_t>(j)] * slopes_.segment(j * d, d);
  riccati_at(elapsed_ + s, P_);
}

const Posterior& KalmanBucyFilter::posterior() {
  gaussian_.assign(m_, P_, posterior_);
  posterior_.log_evidence = log_evidence_;
  return posterior_;
}

}  // namespace wienertree
