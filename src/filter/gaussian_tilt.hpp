#pragma once
/// Sums of Gaussians multiplied by the exponential of a quadratic.
#include <Eigen/Core>

#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// h(x) = exp(-u^T H u/2 + f^T u), u = x - centre, H symmetric and positive semidefinite.
struct Tilt {
  Eigen::VectorXd centre;  ///< d
  Eigen::MatrixXd H;       ///< d x d
  Eigen::VectorXd f;       ///< d
  static Tilt none(std::size_t d);
  bool flat() const { return H.isZero(0) && f.isZero(0); }
};

/// Multiplies by h: with u = m - centre, P = L L^T, B = 1 + L^T H L, r = f - H u
///
///     P^ = L B^{-1} L^T,   m^ = m + P^ r,
///     log-weight += -log|B|/2 + f^T u - u^T H u/2 + r^T P^ r/2.
///
/// Constants of h cancel where it is divided out again.
void multiply(GaussianComponents& components, const Tilt& h, ThreadPool* threads);

/// Divides by h: the same with -H, -f, which leaves a law where P < H^{-1}. Returns how many components were too
/// wide for that: they are left as they are, and listed in `wide`.
void divide(GaussianComponents& components, const Tilt& h, std::vector<std::uint32_t>& wide,
            ThreadPool* threads);

/// h multiplied onto one law. @pre P positive semidefinite
void multiply(Eigen::VectorXd& m, Eigen::MatrixXd& P, const Tilt& h);

}  // namespace wienertree
