#pragma once
/// Wide components split into narrow ones.
#include <Eigen/Core>
#include <map>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// In coordinates in which a law of covariance S is standard, the eigenvalues e_k of each covariance P are clipped
/// to kappa^2, and what is cut off is given to the means: along the a directions in which e_k - kappa^2 exceeds
/// kappa^2/50 the component becomes the sum of components at m + sum_k sqrt(e_k - kappa^2) z_k v_k, z the points of
/// a Gaussian rule in R^a. Mass, mean and covariance are kept, and all moments of degree 5.
class ComponentSplit {
 public:
  /// @param most  a tensor rule of Gauss and Hermite takes the place of the rule of degree 5 as long as all
  ///              children number at most `most`: a single wide Gaussian needs more than a few points
  void split(const GaussianComponents& parents, const Eigen::MatrixXd& S, double kappa, std::size_t most,
             GaussianComponents& children, ThreadPool* threads);

 private:
  const GaussianCubature& rule(int directions, int per_axis);

  std::map<std::pair<int, int>, GaussianCubature> rules_;
  Batch axes_, narrow_;  ///< d*d x N: sqrt(residual) v_k, the active ones last; what P becomes
  std::vector<std::uint8_t> directions_;  ///< N: a
  std::vector<std::size_t> first_;        ///< N: first child
};

}  // namespace wienertree
