#pragma once
/// The Kalman-Bucy filter (Kalman, Bucy 1961, J. Basic Eng. 83, 95-108) of the linear model
///
///     dX = (A X + a) dt + B dV,     dY = (H X + c) dt + dW,     X_0 ~ N(m_0, P_0),     Q = B B^T:
///
///     P'   = A P + P A^T + Q - P H^T H P                              (CVODE)
///     dm   = (A m + a) dt + P H^T (dY - (H m + c) dt)
///     log rho_t(1) = int (H m + c).dY - 1/2 int |H m + c|^2 dt        (Ito)
///
/// Y is taken to be linear between its rows. The first equation has no noise and the second one a
/// deterministic coefficient of dY, so that they hold as they stand; the Ito integral of the third is the
/// ordinary one less its correction 1/2 int tr(H P H^T) dt.
#include <Eigen/LU>
#include <optional>

#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/linear_gaussian.hpp"
#include "wienertree/filter/riccati.hpp"

namespace wienertree {

/// Mean and evidence are integrated by the three-stage Gauss method, of order 6 (Butcher 1964), in steps so
/// short that its error on exp(F s), 1e-5 (|F| s)^7, stays below 1e-12.
class KalmanBucyFilter final : public Filter {
 public:
  /// @throws InputError unless the model is linear with continuous observations or none
  explicit KalmanBucyFilter(const Model& model);
  void advance(const ObservationWindow& window) override;
  const Posterior& posterior() override;
  std::string_view name() const override { return "kalman-bucy"; }

 private:
  void exchange_state(StateArchive& archive) override;
  void pass_gap(double length, const Eigen::VectorXd& slope);
  void gauss_step(double s, const Eigen::VectorXd& slope);
  double rate() const;

  LinearGaussianModel model_;
  bool observed_;
  void start_riccati(double tau);
  void riccati_at(double t, Eigen::MatrixXd& P);

  std::optional<RiccatiEquation> riccati_;
  double riccati_tau_ = 0;                  // with which it was made
  std::optional<double> first_riccati_at_;  // time at which it was read first
  double elapsed_ = 0;                      // since the start
  Eigen::VectorXd m_;
  Eigen::MatrixXd P_;
  double log_evidence_ = 0;

  Eigen::MatrixXd stage_P_, gain_, drift_, system_;  // of a step
  Eigen::VectorXd slopes_, stage_m_, sensor_, stage_trace_, increment_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  SingleGaussian gaussian_;
  Posterior posterior_;
};

}  // namespace wienertree
