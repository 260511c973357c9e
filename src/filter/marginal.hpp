#pragma once
/// The law of one component under a posterior: distribution function, density, quantiles.
#include <span>
#include <vector>

#include "wienertree/filter/posterior.hpp"

namespace wienertree {

/// A Gaussian sum is used as it is. Children of a tree stand for a diffusion's step: c atoms a parent, which
/// on a uniform grid with constant diffusion pile up on a lattice of the width of a step, so that their own
/// distribution function is a staircase. Each family is therefore replaced by the Gaussian of its mean and
/// variance, the leading order of the step's true law; mean and variance of the whole are unchanged. Other
/// Dirac masses (particles, a start) are left as they are: their distribution function is taken to pass
/// through (x_(n), w_(1) + .. + w_(n-1) + w_(n)/2) and to be linear between.
///
/// More than 512 Gaussians are merged, mean and variance kept, into as many cells over the mean +- 8 standard
/// deviations: a cell is then 1/32 standard deviation wide.
class Marginal {
 public:
  /// Component i. @pre i < posterior.points.components()
  Marginal(const Posterior& posterior, std::size_t i);

  double distribution(double x) const;  ///< P(X_i <= x)
  /// @pre has_density()
  double density(double x) const;
  bool has_density() const { return has_density_; }
  /// For ascending `levels` in (0,1).
  void quantiles(std::span<const double> levels, std::span<double> out) const;

 private:
  struct Gaussian {
    double weight, mean, sd;
  };
  struct Family {
    double weight, mean, variance;
  };
  void add_families(std::size_t parents, std::vector<Family>& out) const;
  static void merge(std::vector<Family>& families);
  double gaussian_quantile(double level) const;

  bool has_density_ = false;
  std::vector<Gaussian> gaussians_;         ///< empty for Dirac masses
  std::span<const double> atoms_, weight_;  ///< Dirac masses
};

}  // namespace wienertree
