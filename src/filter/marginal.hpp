#pragma once
/// The law of one component under a posterior: distribution function, density, quantiles.
#include <array>
#include <span>
#include <vector>

#include "wienertree/filter/posterior.hpp"

namespace wienertree {

/// The law of families on the line (family_law.hpp) is used as it is, and so is a Gaussian sum. Children of a tree stand for a diffusion's step: c atoms a parent, which pile up on a
/// lattice of the width of a step, and the parents themselves are far apart beside a short step, so that the atoms' own
/// distribution function is a staircase. Each family is therefore replaced by the Gaussian N(m_i, C_i) of its mean and
/// variance, the leading order of the step's true law, and the sum of these is smoothed by a Gaussian kernel of standard
/// deviation h whose effect is taken back to order h^6:
///     f = (1 - h^2/2 D^2 + h^4/8 D^4 - h^6/48 D^6) (sum_i w_i N(m_i, C_i + h^2)),
/// a kernel of order 8 (its first seven moments but the mass are 0), so that moments to degree 7 are those of the nodes.
/// h is a part of the law's narrowest width: h = 0.35 S on the line (60 families), 0.7 S in the plane (300) and in
/// space (600), in proportion to the number of families to the power -1/6, where S = 1/(sqrt(2 pi) max f), that of a Gaussian whose density is
/// as high, found by iteration from the law's own standard deviation downwards, to an eighth of it. The density, negative by at most the
/// kernel's side lobes, is cut at 0, and its quantiles stay within the nodes that have mass.
/// Few families (12 on the line, 50 in the plane, 200 in space: what a start at a point has grown to in its first steps)
/// know no more of a law than its moments. Where these are near a Gaussian's, |E He_3(Z)| <= 1/2 and |E He_4(Z)| <= 1/2 for
/// the standardised component Z, its density is the expansion of Gram and Charlier about N(0,1) with the moments of
/// degree 3 to 5 of the families (Kolassa 2006, Series Approximation Methods in Statistics, section 3).
/// Quantiles stay inside the state's bounds.
/// Other Dirac masses (particles, a start) are left as they are: their distribution function is taken to pass through
/// (x_(n), w_(1) + .. + w_(n-1) + w_(n)/2) and to be linear between.
///
/// More than 512 Gaussians are merged, mean and variance kept, into as many cells over the mean +- 8 standard
/// deviations for each factor of 2 in variance: a cell is then 1/32 standard deviation wide, and narrow Gaussians are not
/// mixed with wide ones.
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
    double kernel = 0;  ///< rho = h^2/sd^2, the part of the variance that is the kernel's
  };
  struct Family {
    double weight, mean, variance;
  };
  void add_families(std::size_t parents, std::vector<Family>& out) const;
  static void merge(std::vector<Family>& families);
  bool expand(const std::vector<Family>& families);
  double gaussian_quantile(double level) const;
  void smooth(double kernel_width);  ///< h/S
  /// The Gaussians `plain` under the kernel of standard deviation h.
  void widen(const std::vector<Gaussian>& plain, double h);
  double sum_of_densities(double x) const;

  const FamilyLaw* law_ = nullptr;
  bool has_density_ = false;
  double lowest_ = 0, highest_ = 0;         ///< nodes with mass, of families
  StateBound bounds_;                       ///< of the component
  bool expanded_ = false;                   ///< one Gaussian times 1 + sum_k hermite_[k-3] He_k
  std::array<double, 3> hermite_{};         ///< E He_k(Z)/k!, k = 3, 4, 5
  std::vector<Gaussian> gaussians_;         ///< empty for Dirac masses
  std::span<const double> atoms_, weight_;  ///< Dirac masses
};

}  // namespace wienertree
