#pragma once
/// Components conditioned on a discrete observation.
#include <memory>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/filter/observation_expansion.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// Multiplies every component by the likelihood g(y|x) and replaces each product by the Gaussian of its mass, mean
/// and covariance.
///
/// A linear sensor with Gaussian noise is taken in exactly, one component of y after another, in Joseph's form
/// P' = (1 - K h) P (1 - K h)^T + K R K^T. Otherwise Newton's method, in coordinates x = m + L z with L L^T = P,
/// finds the mode z* of l(x) - z^T z/2 and its curvature 1 + A; points of a Gaussian rule z_q = z^ + R^{-T} zeta_q
/// with R R^T = 1 + A, z^ the mode of the quadratic, get the weights
///
///     omega_q = w_q exp(l(x_q) - z_q^T z_q/2 + zeta_q^T zeta_q/2) / |R|,
///
/// the exact over the linearised likelihood, and mass, mean and covariance are theirs: the linearisation leaves no
/// bias beyond that of the rule.
class ComponentConditioning {
 public:
  /// The model must outlive it.
  explicit ComponentConditioning(const Model& model);

  /// departure: the root mean square over components, weighted by what they are worth after the observation, of
  /// the standard deviation of log (exact over linearised likelihood). Above about .3 the Gaussians are too wide
  /// for this likelihood. 0 where the likelihood is a quadratic.
  struct Result {
    double departure = 0;
  };
  /// @param clock the time the observation belongs to
  Result condition(std::span<const double> y, double clock, GaussianComponents& components,
                   ThreadPool* threads);

  const ObservationExpansion& expansion() const { return expansion_; }

 private:
  struct Scratch {
    Batch root, mode, trial, step, x, gradient, curvature, best_gradient, best_curvature, points;
    std::vector<double> value, best, fraction, log_density;
    ObservationExpansion::Scratch expansion;
  };
  void condition_linear(std::span<const double> y, std::size_t first, std::size_t count,
                        GaussianComponents& c);
  void find_modes(std::span<const double> y, double clock, std::size_t first, std::size_t count,
                  const GaussianComponents& c, Scratch& s) const;
  void condition_block(std::span<const double> y, double clock, std::size_t first, std::size_t count,
                       GaussianComponents& c, Scratch& s);

  const Model& model_;
  ObservationExpansion expansion_;
  GaussianCubature rule_;
  std::vector<std::unique_ptr<Scratch>> scratch_;  ///< one per thread
  std::vector<double> variance_;                   ///< of the log ratio, one per component
};

}  // namespace wienertree
