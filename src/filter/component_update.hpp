#pragma once
/// An observation taken in by components that are divided where it calls for it.
#include "wienertree/filter/component_conditioning.hpp"

namespace wienertree {

/// Adaptive quadrature in the likelihood: all components are conditioned; those whose logarithm of exact over
/// linearised likelihood spreads by more than a tolerance, or that may hide a mode (component_conditioning.hpp), and
/// that count, are divided as they were before the observation, and their parts are conditioned in their place, until
/// none is left. In coordinates in which a component is standard, it is divided along the unit vector v that its
/// reading names:
///
///     N(0, 1) = sum_j w_j N(sqrt(1 - kappa^2) u_j, kappa^2)   along v,
///
/// u_j equidistant, 1.5 kappa apart, w_j proportional to exp(-u_j^2/2): the density ripples by
/// 2 exp(-2 pi^2/1.5^2) = 3e-4 of itself. kappa^2 is that part of the variance v^T (1 + A)^{-1} v that the observation
/// leaves which brings the spread, quadratic in it at least, to the tolerance, between 1/16 and 1/2 of it, or 1/4 where
/// a mode may hide. The tolerance for the spread is that for a component as wide as the law; for one whose variance is
/// the part f of the law's it is 1/f times that, and eight times at most: what a narrow component lacks in skewness the
/// law does not show.
class ComponentUpdate {
 public:
  /// The model must outlive it.
  explicit ComponentUpdate(const Model& model) : conditioning_(model) {}

  struct Limits {
    double spread = 0.05;  ///< of the log ratio, in a component that counts and is as wide as the law
    std::size_t components = 3200;  ///< that are divided in one round, counted as their parts
  };
  /// @return the root mean square of the spread, weighted by what components are worth after the observation, if that
  /// exceeds the tolerance by far: they were too many; else 0
  double condition(std::span<const double> y, double clock, const Limits& limits,
                   GaussianComponents& components, ThreadPool* threads);
  std::uint64_t conditioned() const { return conditioned_; }  ///< components, so far
  const ObservationExpansion& expansion() const { return conditioning_.expansion(); }

 private:
  struct Division {
    std::size_t component;
    double kappa, worth;
    std::size_t parts;
  };
  void choose(const GaussianComponents& conditioned, double log_mass, const Limits& limits);
  void divide(const GaussianComponents& prior);

  ComponentConditioning conditioning_;
  GaussianComponents prior_, parts_, accepted_;
  std::vector<Division> divisions_;
  std::vector<std::uint8_t> divided_;
  std::vector<double> spread_;  ///< of accepted components
  std::uint64_t conditioned_ = 0;
};

}  // namespace wienertree
