#pragma once
/// The logarithm of a discrete observation's likelihood as a quadratic of the state.
#include <span>
#include <vector>

#include "wienertree/model/model.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// l(x) = log g(y|x) about points x, along directions: with x(z) = x + L z,
///
///     l(x(z)) ~ l(x) + b^T z - z^T A z/2,     A positive semidefinite.
///
/// For y = h(x) + v with independent v_i of density exp(psi_i), r = y - h(x) and J the derivative of h along the
/// columns of L: b = -J^T psi'(r), A = J^T W J (Gauss and Newton), W_i = -psi_i'' where that is positive, else the
/// weight of iteratively reweighted least squares -psi_i'(r_i)/r_i, which bounds heavy-tailed laws from below.
/// For any other density the gradient and the Hessian of l by central differences, eigenvalues clipped at zero.
class ObservationExpansion {
 public:
  /// The model must outlive it. @pre discrete observations
  explicit ObservationExpansion(const Model& model);

  struct Scratch {
    Batch points, sensor;
    std::vector<double> value;
  };
  /// value N, gradient d x N, curvature d*d x N.
  /// @param x d x N  @param L d*d x N, columns are directions (component i*d + k)
  /// @param step d x N: differences are taken over +-step along direction k
  void expand(std::span<const double> y, double clock, ConstBatchView x, ConstBatchView L,
              ConstBatchView step, std::span<double> value, BatchView gradient, BatchView curvature,
              Scratch& scratch) const;
  /// l at points of d reported states. points: state_dimension() x N, the first d filled in.
  void log_density(std::span<const double> y, double clock, BatchView points, std::span<double> out) const;

  /// y = H x + c + Gaussian noise, so that l is a quadratic.
  bool linear_gaussian() const { return sensor_ != nullptr && !variances_.empty(); }
  const AffineSensor* affine_sensor() const { return sensor_; }
  const std::vector<double>& gaussian_variances() const { return variances_; }
  bool additive() const { return additive_; }
  /// Of additive noise: the density falls by e^{-1/2} over so much.
  const std::vector<double>& scales() const { return scale_; }

 private:
  void expand_additive(std::span<const double> y, ConstBatchView x, BatchView gradient, BatchView curvature,
                       ConstBatchView step, Scratch& scratch) const;
  void expand_any(std::span<const double> y, double clock, ConstBatchView x, ConstBatchView L,
                  ConstBatchView step, BatchView gradient, BatchView curvature, Scratch& scratch) const;
  void complete(BatchView points, double clock) const;
  double noise(std::size_t i, double v) const;

  const Model& model_;
  std::size_t d_, k_;
  bool additive_ = false;
  const AffineSensor* sensor_ = nullptr;
  std::vector<double> variances_;
  std::vector<double> scale_;  ///< of each noise: its density falls by e^{-1/2} over so much
};

}  // namespace wienertree
