#pragma once
/// The matrix Riccati equation of the Kalman-Bucy filter by CVODE.
#include <Eigen/Core>
#include <memory>

namespace wienertree {

/// P' = A P + P A^T + Q - P H^T H P from P(0), read at increasing times.
///
/// It does not depend on the observations and has no jumps, so that one integration (BDF, Newton) runs
/// through all steps of a filter and is read between its own steps. Local errors are kept below
/// 1e-12 s_i s_j for component (i, j), s_i^2 = P_ii + Q_ii tau + 1e-6 max_k (P_kk + Q_kk tau): relative to
/// the state's own scale, which tau sets where P starts at zero.
class RiccatiEquation {
 public:
  /// A, Q, P: d x d, Q and P symmetric;  H: k x d, k >= 0;  tau: time after which P is first of interest.
  /// @throws RunError if SUNDIALS cannot be set up
  RiccatiEquation(const Eigen::MatrixXd& A, const Eigen::MatrixXd& Q, const Eigen::MatrixXd& H,
                  const Eigen::MatrixXd& P, double tau);
  ~RiccatiEquation();
  RiccatiEquation(RiccatiEquation&&) noexcept;

  /// P(t) -> out, d x d symmetric. @pre t is not below that of the call before, nor below 0
  /// @throws RunError naming the time if CVODE gives up
  void at(double t, Eigen::MatrixXd& out);

 private:
  class Integration;
  std::unique_ptr<Integration> integration_;
};

}  // namespace wienertree
