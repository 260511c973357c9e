#pragma once
/// Seam 1: the vector fields of a Stratonovich SDE with its sensor, evaluated over batches.
///
///     dX = V_0(X) dt + sum_{j=1..p} V_j(X) o dB^j,        dY = h(X) dt + dW
///
/// with X in R^d, B in R^p, Y in R^k. The Ito drift is V~_0 = V_0 + 1/2 sum_j (DV_j) V_j.
#include <Eigen/Core>
#include <span>
#include <vector>

#include "wienertree/numeric/batch.hpp"

namespace wienertree {

/// Every field affine: V_k(x) = linear[k] x + constant[k], k = 0..p (Stratonovich). Then a segment's flow is
/// an affine map and the Kalman-Bucy filter may apply.
struct AffineFields {
  std::vector<Eigen::MatrixXd> linear;    ///< 1+p matrices, d x d
  std::vector<Eigen::VectorXd> constant;  ///< 1+p vectors, d
};

/// Affine sensor h(x) = linear x + constant.
struct AffineSensor {
  Eigen::MatrixXd linear;    ///< k x d
  Eigen::VectorXd constant;  ///< k
};

/// Evaluations are const, thread-safe, free of allocation after the first call on a thread, and give for each
/// node a value that depends on that node's state alone, bit for bit, wherever the node sits in the batch.
/// Input and output views never overlap. A value out of the domain (sqrt of a negative number) is NaN, not an
/// exception.
class VectorFields {
 public:
  virtual ~VectorFields() = default;
  virtual std::size_t state_dimension() const = 0;   ///< d
  virtual std::size_t noise_dimension() const = 0;   ///< p
  virtual std::size_t sensor_dimension() const = 0;  ///< k; 0 without observation

  /// out(i, n) = sum_{k=0..p} V_k^i(x_n) D_k.   x, out: d x N;  D: 1+p values.
  virtual void direct(ConstBatchView x, std::span<const double> D, BatchView out) const = 0;
  /// out(i*d + l, n) = d/dx_l sum_k V_k^i(x_n) D_k.   out: d*d x N.
  virtual void jacobian(ConstBatchView x, std::span<const double> D, BatchView out) const = 0;
  /// Euler-Maruyama: out(i, n) = x_n^i + V~_0^i(x_n) dt + sum_j V_j^i(x_n) dB(j-1, n).   dB: p x N.
  virtual void euler_step(ConstBatchView x, double dt, ConstBatchView dB, BatchView out) const = 0;
  /// out(i, n) = V~_0^i(x_n), the Ito drift.   out: d x N.
  virtual void ito_drift(ConstBatchView x, BatchView out) const = 0;
  /// out(i*p + j-1, n) = V_j^i(x_n), j = 1..p.   out: d*p x N.
  virtual void diffusion(ConstBatchView x, BatchView out) const = 0;
  /// out(i, n) = h_i(x_n).   out: k x N.
  virtual void sensor(ConstBatchView x, BatchView out) const = 0;
  /// out(i*p + r-1, n) = (V_r h_i)(x_n) = sum_l V_r^l d h_i/dx_l, r = 1..p.   out: k*p x N.
  virtual void sensor_derivative(ConstBatchView x, BatchView out) const = 0;

  /// Facts found by analysis, or nullptr.
  virtual const AffineFields* affine_fields() const { return nullptr; }
  virtual const AffineSensor* affine_sensor() const { return nullptr; }
  /// True when `exact_flow` works.
  virtual bool has_exact_flow() const { return false; }
  /// Closed form of x <- solution at u = 1 of dx/du = sum_k V_k(x) D_k, in place.   x: d x N.
  /// @pre has_exact_flow()
  virtual void exact_flow(std::span<const double> D, BatchView x) const;
};

}  // namespace wienertree
