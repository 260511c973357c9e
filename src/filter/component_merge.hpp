#pragma once
/// Many components merged into few.
#include <Eigen/Core>

#include "wienertree/filter/gaussian_components.hpp"

namespace wienertree {

/// Law of a sum of Gaussians, normalised.
struct MixtureMoments {
  double log_mass = 0;
  double effective_size = 0;  ///< 1/sum w^2
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};
MixtureMoments moments(const GaussianComponents& components);

/// A k-d tree cuts components into patches: across the principal axis of the means in a patch, in coordinates in
/// which the whole law is standard, at the place that halves shares u_n = .7 sqrt(w_n)/sum sqrt(w) + .3/N. Each patch
/// becomes one Gaussian of its mass, mean and covariance (within and between its components). Two moments suffice
/// where components are much narrower than the law.
class ComponentMerge {
 public:
  /// Into at most `most` components, in place; does nothing where there are not more.
  void merge(GaussianComponents& components, std::size_t most);
  /// Those that noise to come makes indistinguishable: patches are cut, in coordinates z = W m in which that noise is
  /// standard, until the means of each have a standard deviation of at most `width` in every direction, and its
  /// covariances W P W^T one of at most width^(3/2) in Frobenius' norm. What merging loses of the law afterwards is a
  /// third cumulant of at most width^3 times the skewness of the patch, and a fourth of at most 3 width^3.
  void merge_close(GaussianComponents& components, const Eigen::MatrixXd& W, double width);
  /// Drops components whose weight is below `part` of the largest.
  static void drop_negligible(GaussianComponents& components, double part);

 private:
  struct Patch {
    std::size_t first, last, parts;
  };
  void lay_out(const GaussianComponents& components, const Eigen::MatrixXd& W, const Eigen::VectorXd& origin,
               double log_mass);
  void join(GaussianComponents& components, double log_mass);
  bool is_close(const Patch& patch, const GaussianComponents& components, const Eigen::MatrixXd& W,
                double width) const;
  std::size_t cut(const Patch& patch);
  void gather(const Patch& patch, const GaussianComponents& from, std::size_t to);

  Batch white_;  ///< d x N: means in the coordinates in which patches are cut
  std::vector<double> weight_, share_, place_;
  std::vector<std::uint32_t> order_;
  std::vector<Patch> open_, patches_;
  GaussianComponents merged_;
};

}  // namespace wienertree
