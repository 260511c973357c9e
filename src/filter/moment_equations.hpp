#pragma once
/// Gaussians moved by the equations of their first two moments.
#include <vector>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// With b the Ito drift and a = sigma sigma^T, X_t taken to be N(m, P) at every moment:
///
///     dm/dt = E b(X),    dP/dt = E b(X)(X - m)^T + E (X - m) b(X)^T + E a(X)
///
/// (Jazwinski 1970, Stochastic Processes and Filtering Theory, section 9.3; with sigma points, Sarkka 2007, IEEE
/// Trans. Autom. Control 52, 1631-1641). Expectations are those of a Gaussian rule of points z_q, weights w_q, at
/// x_q = m + L z_q, L L^T = P, which is of degree 5: exact for cubic drifts. Solved by the classical
/// Runge-Kutta method of order 4, all Gaussians at once. Exact for affine signals but for the error of that
/// method; a singular P, and a singular a, are no exception.
///
/// Points outside a bound of the state are moved to it before fields are evaluated.
class MomentEquations {
 public:
  /// What a thread needs.
  struct Scratch {
    Batch root, points, drift, diffusion, slope, mean, covariance;
    Batch mean_rate[4], covariance_rate[4];
  };

  /// The model must outlive it. rule: in the dimension of the reported states
  MomentEquations(const Model& model, const GaussianCubature& rule);

  /// Gaussians of a block are moved together; blocks are this large.
  std::size_t block() const { return block_; }
  /// mean d x n, covariance d*d x n over `length` from the time `clock`, in `steps` equal steps.
  void move(BatchView mean, BatchView covariance, double clock, double length, unsigned steps,
            Scratch& scratch) const;
  /// out(n): the part of the drift that is not affine under N(m, P), over a time `length`, in standard deviations
  /// of that law: sqrt(E |L^{-1} (b - best affine function)|^2) length.
  void departure_from_affine(ConstBatchView mean, ConstBatchView covariance, double clock, double length,
                             std::span<double> out, Scratch& scratch) const;
  /// out(n): the norm (largest row sum) of the Jacobian of the drift at m.
  void rate(ConstBatchView mean, double clock, std::span<double> out, Scratch& scratch) const;
  /// E a(X) and E b(X) for one law.
  Eigen::MatrixXd mean_diffusion(const Eigen::VectorXd& m, const Eigen::MatrixXd& P, double clock,
                                 Scratch& scratch) const;

  const GaussianCubature& rule() const { return rule_; }
  std::size_t states() const { return d_; }
  /// Fills the clock's component, where there is one, and moves points into bounds.
  void complete(BatchView points, double clock) const;

 private:
  void lay_points(ConstBatchView mean, ConstBatchView covariance, double clock, Scratch& scratch) const;
  void rates(ConstBatchView mean, ConstBatchView covariance, double clock, Batch& mean_rate,
             Batch& covariance_rate, Scratch& scratch) const;
  void add_diffusion(std::size_t n, Batch& covariance_rate, Scratch& scratch) const;

  const Model& model_;
  GaussianCubature rule_;
  std::size_t d_, points_, block_;
};

}  // namespace wienertree
