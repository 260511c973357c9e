#include "wienertree/filter/kalman_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "wienertree/filter/places.hpp"
#include "wienertree/model/affine_flow.hpp"

namespace wienertree {
namespace {

Eigen::MatrixXd exponential(const Eigen::MatrixXd& M) {
  const Eigen::Index n = M.rows();
  Eigen::MatrixXd E(n, n), scratch(n, 2 * n);
  const auto span = [](auto& x) { return std::span(x.data(), static_cast<std::size_t>(x.size())); };
  exponential_minus_identity(span(M), static_cast<std::size_t>(n), span(E), span(scratch));
  return E + Eigen::MatrixXd::Identity(n, n);
}

double norm_1(const Eigen::MatrixXd& M) { return M.cwiseAbs().colwise().sum().maxCoeff(); }

}  // namespace

LinearTransition linear_transition(const LinearGaussianModel& model, double s) {
  const Eigen::Index d = model.A.rows();
  if (const double size = norm_1(model.A) * s; !std::isfinite(size))
    throw RunError("the drift over a step is beyond what a double represents", "linear transition",
                   fmt::format("{} over a step of {}", norm_1(model.A), s));
  Eigen::MatrixXd affine = Eigen::MatrixXd::Zero(d + 1, d + 1);
  affine.topLeftCorner(d, d) = s * model.A;
  affine.topRightCorner(d, 1) = s * model.a;
  const Eigen::MatrixXd E = exponential(affine);
  LinearTransition t{E.topLeftCorner(d, d), E.topRightCorner(d, 1), Eigen::MatrixXd::Zero(d, d)};

  // exp [-A Q; 0 A^T] u = [. G; 0 F^T]  with  Q_u = F G.
  const double size = norm_1(model.A) * s;
  const int halvings = size > 1 ? static_cast<int>(std::ceil(std::log2(size))) : 0;
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(2 * d, 2 * d);
  block.topLeftCorner(d, d) = -model.A;
  block.topRightCorner(d, d) = model.Q;
  block.bottomRightCorner(d, d) = model.A.transpose();
  block = exponential(std::ldexp(s, -halvings) * block);
  Eigen::MatrixXd F = block.bottomRightCorner(d, d).transpose();
  t.Q = F * block.topRightCorner(d, d);
  for (int i = 0; i < halvings; ++i) {
    t.Q += (F * t.Q * F.transpose()).eval();
    F = (F * F).eval();
  }
  t.Q = (0.5 * (t.Q + t.Q.transpose())).eval();
  return t;
}

KalmanFilter::KalmanFilter(const Model& model) : model_(linear_gaussian_model(model)) {
  if (model.observation == ObservationKind::continuous)
    throw InputError("the Kalman filter takes discrete observations; for continuous ones use kalman-bucy",
                     "model " + model.name);
  if (model.observation == ObservationKind::discrete) {
    noise_variance_ = model.density->gaussian_variances();
    if (noise_variance_.empty() || std::ssize(noise_variance_) != model_.H.rows())
      throw InputError("the Kalman filter needs a sensor with additive Gaussian noise",
                       "model " + model.name);
  }
  m_ = model_.mean;
  P_ = model_.covariance;
}

void KalmanFilter::advance(const ObservationWindow& window) {
  if (window.at_start) weigh(window);
  if (window.length() > 0) predict(window.length());
  if (!window.at_start) weigh(window);
  posterior_.time = window.end;
  ++statistics_.steps;
}

void KalmanFilter::predict(double length) {
  if (length != transition_length_) {
    transition_ = linear_transition(model_, length);
    transition_length_ = length;
  }
  m_ = (transition_.F * m_ + transition_.f).eval();
  P_ = (transition_.F * P_ * transition_.F.transpose() + transition_.Q).eval();
}

void KalmanFilter::weigh(const ObservationWindow& window) {
  const Eigen::Index d = m_.size();
  for (std::size_t i = 0; i < window.observation.size(); ++i) {
    const double y = window.observation[i];
    if (std::isnan(y)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::RowVectorXd h = model_.H.row(row);
    const double R = noise_variance_[i], s = h * P_ * h.transpose() + R, e = y - h * m_ - model_.c(row);
    const double term = -(std::log(2 * std::numbers::pi * s) + e * e / s) / 2;
    if (!std::isfinite(term))
      throw RunError("the observation has no likelihood", place_and_observation(window),
                     fmt::format("y{} = {}", i + 1, y));
    const Eigen::VectorXd K = P_ * h.transpose() / s;
    const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(d, d) - K * h;
    m_ += K * e;
    P_ = (rest * P_ * rest.transpose() + K * R * K.transpose()).eval();
    P_ = (0.5 * (P_ + P_.transpose())).eval();
    log_evidence_ += term;
  }
}

void KalmanFilter::exchange_state(StateArchive& archive) {
  archive(m_, P_, log_evidence_, posterior_.time);
  StateArchive::require(m_.size() == model_.A.rows() && P_.rows() == m_.size() && P_.cols() == m_.size());
}

const Posterior& KalmanFilter::posterior() {
  gaussian_.assign(m_, P_, posterior_);
  posterior_.log_evidence = log_evidence_;
  return posterior_;
}

}  // namespace wienertree
