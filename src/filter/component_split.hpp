#pragma once
/// Wide components split into narrow ones.
#include <Eigen/Core>
#include <map>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// In coordinates in which a law of covariance S is standard, the eigenvalues e_k of each covariance P are clipped
/// to kappa^2, and what is cut off, r_k^2 = e_k - kappa^2, is given to the means: along the directions in which it
/// exceeds kappa^2/50 the component becomes the sum of components at m + sum_k r_k z_k v_k. Mass, mean and covariance
/// are kept, and all moments of degree 5. The points z_k are
///
/// - 3 of Gauss and Hermite up to r = .92 kappa (all directions together: a rule of degree 5), 5 up to 1.18 kappa and 7
///   up to 1.39 kappa,
/// - beyond, a lattice of spacing 1.6 kappa / r,
///
/// so that parts are at most 1.6 kappa apart, which leaves ripples of exp(-2 pi^2/1.6^2) = 4e-4 in the density.
class ComponentSplit {
 public:
  /// @param wanted  parts are laid closer than that, up to eight times, as long as there are no more than `wanted`: to
  ///                merge many is more exact than to merge few
  /// @param most  of all parts. Where it does not suffice, directions are divided in fewer points, and clipped to what
  ///              these suffice for, in place of kappa; but never in fewer than 3
  void split(const GaussianComponents& parents, const Eigen::MatrixXd& S, double kappa, std::size_t wanted,
             std::size_t most, GaussianComponents& children, ThreadPool* threads);

 private:
  /// The points of one direction, or of several under a rule of degree 5.
  const GaussianCubature& rule(int directions, int points);

  std::map<std::pair<int, int>, GaussianCubature> rules_;
  Batch eigenvalues_, axes_;          ///< d x N; d*d x N: v_k
  std::vector<std::uint8_t> points_;  ///< d x N, component by component: of each direction
  std::vector<std::size_t> first_;    ///< N + 1: first part
};

}  // namespace wienertree
