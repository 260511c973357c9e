#pragma once
/// The Kalman filter of a linear model seen at discrete times (Kalman 1960, J. Basic Eng. 82, 35-45):
///
///     dX = (A X + a) dt + B dV,      y_r = H X + c + N(0, diag(R))  at the times of the rows,
///
/// the state discretised without error (Van Loan 1978, IEEE Trans. Autom. Control 23, 395-404). The
/// components of a row are taken one after the other, as their noises are independent: with prediction
/// N(m, P) and sensor row g = (h, c_i),
///
///     s = h P h^T + R_i,   e = y_i - h m - c_i,   K = P h^T / s,   m <- m + K e,
///     P <- (I - K h) P (I - K h)^T + K R_i K^T        (Joseph's form, which keeps P positive)
///     log-likelihood += -(log(2 pi s) + e^2/s)/2,
///
/// and a missing component is left out.
#include <optional>

#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/linear_gaussian.hpp"

namespace wienertree {

/// X_{t+s} = F X_t + f + N(0, Q).
struct LinearTransition {
  Eigen::MatrixXd F;  ///< d x d
  Eigen::VectorXd f;  ///< d
  Eigen::MatrixXd Q;  ///< d x d
};

/// F = exp(A s), f = int_0^s exp(A u) a du, Q = int_0^s exp(A u) Q exp(A u)^T du.
/// Van Loan's block exponential for a step s/2^n on which |A| s/2^n <= 1, then n times
/// Q <- Q + F Q F^T, F <- F F: a sum of positive terms, where the block exponential of the whole step would
/// cancel.
LinearTransition linear_transition(const LinearGaussianModel& model, double s);

class KalmanFilter final : public Filter {
 public:
  /// @throws InputError unless the model is linear with discrete observations under Gaussian noise, or
  /// without observations
  explicit KalmanFilter(const Model& model);
  /// @throws RunError naming step, time and observation when its likelihood is zero
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "kalman"; }

 private:
  void exchange_state(StateArchive& archive) override;
  void predict(double length);
  void weigh(const ObservationWindow& window);

  LinearGaussianModel model_;
  std::vector<double> noise_variance_;  // k
  Eigen::VectorXd m_;
  Eigen::MatrixXd P_;
  double log_evidence_ = 0;
  double transition_length_ = -1;
  LinearTransition transition_;  // over transition_length_
  SingleGaussian gaussian_;
  Posterior posterior_;
};

}  // namespace wienertree
