#pragma once
/// Components conditioned on a discrete observation.
#include <memory>

#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/gaussian_components.hpp"
#include "wienertree/filter/observation_expansion.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// Whether nothing was observed: all values are NaN.
bool all_missing(std::span<const double> y);

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
/// bias beyond that of the rule. R^{-T} = V b^{-1/2}, V the eigenvectors and b the eigenvalues of 1 + A, so that the
/// axes of the rule are those of the conditioned component.
///
/// What this cannot see, a second mode, is looked for at the points m + L zeta_q of the component itself: where the
/// sensor has a part rho that is not affine over it, of more than .3 of the noise's scale and more than half of the
/// affine part lambda; where the noise is not Gaussian and lambda above two of its scales; and where the likelihood at
/// such a point is within e^-8 of the largest, and not what the linearisation says to a factor e^2.
class ComponentConditioning {
 public:
  /// The model must outlive it.
  explicit ComponentConditioning(const Model& model);

  /// What is known of each component after `condition`; of a quadratic log-likelihood nothing is asked.
  struct Reading {
    std::vector<double> departure;    ///< standard deviation of log (exact over linearised likelihood)
    std::vector<std::uint8_t> hides;  ///< whether it may have modes that were not found
    std::vector<double> guess;  ///< log-weight after the observation, from the points of the component itself
    std::vector<double> narrowing;  ///< variance along `axis` after the observation over that before
    Batch axis;                     ///< d x N: L v, v the unit vector along which it should be divided
  };
  const Reading& reading() const { return reading_; }

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
    Batch sensor;
    std::vector<double> value, best, fraction, log_density, ratio;
    ObservationExpansion::Scratch expansion;
  };
  void condition_linear(std::span<const double> y, std::size_t first, std::size_t count,
                        GaussianComponents& c);
  void find_modes(std::span<const double> y, double clock, std::size_t first, std::size_t count,
                  const GaussianComponents& c, Scratch& s) const;
  void condition_block(std::span<const double> y, double clock, std::size_t first, std::size_t count,
                       GaussianComponents& c, Scratch& s);

  void look_around(std::span<const double> y, double clock, std::size_t first, std::size_t count,
                   const GaussianComponents& prior, Scratch& s);

  const Model& model_;
  ObservationExpansion expansion_;
  GaussianCubature rule_;
  std::vector<std::unique_ptr<Scratch>> scratch_;  ///< one per thread
  Reading reading_;
};

}  // namespace wienertree
