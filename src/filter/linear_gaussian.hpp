#pragma once
/// The matrices of a linear model with Gaussian noise, and the posteriors of its exact filters.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "wienertree/filter/posterior.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// dX = (A X + a) dt + B dV with Q = B B^T, X_0 ~ N(mean, covariance), seen through H X + c.
struct LinearGaussianModel {
  Eigen::MatrixXd A;           ///< d x d
  Eigen::VectorXd a;           ///< d
  Eigen::MatrixXd Q;           ///< d x d
  Eigen::MatrixXd H;           ///< k x d; no rows where nothing is observed
  Eigen::VectorXd c;           ///< k
  Eigen::VectorXd mean;        ///< d
  Eigen::MatrixXd covariance;  ///< d x d, zero for a fixed start
};

/// @throws InputError saying what is not linear: the drift, the diffusion (which must not depend on the
/// state), the sensor of an observed model, or a bound on a state, which no linear law obeys
LinearGaussianModel linear_gaussian_model(const Model& model);

/// N(m, P) in the shape of a Posterior: a Dirac mass where P = 0.
class SingleGaussian {
 public:
  /// Eigenvalues of P below zero, which rounding makes, are raised to zero.
  void assign(const Eigen::VectorXd& m, const Eigen::MatrixXd& P, Posterior& posterior);

 private:
  Batch point_, covariance_;
  std::vector<double> weight_ = {1.0};
};

}  // namespace wienertree
