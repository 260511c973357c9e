#pragma once
/// The tilts of a gap: what the next observation says of the state before it.
#include <functional>
#include <vector>

#include "wienertree/filter/gaussian_tilt.hpp"
#include "wienertree/filter/moment_equations.hpp"

namespace wienertree {

struct LawMoments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// h_0 .. h_K at the ends of K equal substeps, h_j(x) an approximation of the density of the next observation given
/// the state x at substep j: filtering with the law times h_j, divided out again, is Doob's transform of the signal
/// without its stochastic integral (guided proposals: Schauer, van der Meulen, van Zanten 2017, Bernoulli 23,
/// 2917-2950, linearise once; here the linearisation is that of the tilted law itself).
///
/// Reference laws ref_0 .. ref_K start as the untilted law by its moment equations. Thrice: for each substep of
/// length s the flow of the drift is regressed on ref_j = N(m, P): x -> F (x - m) + g, residual covariance Om; with
/// a = E sigma sigma^T, Fh = (1 + F)/2, the noise adds s/4 sum D^2 b : a s to the mean and
/// Q = s/6 (F a F^T + 4 Fh a Fh^T + a) + Om to the covariance; and from H_K, f_K, u = x - m,
///
///     V = (1 + H Q)^{-1},   f <- F^T V (f - H g'),   H <- F^T V H F,    g' = g - next reference mean,
///
/// after which ref_j is the forward linear law times h_j.
class TiltPath {
 public:
  /// The tilt at the end of the gap, given the reference law there.
  using Final = std::function<Tilt(const LawMoments&)>;

  TiltPath(const Model& model, const MomentEquations& equations) : model_(model), equations_(equations) {}
  /// @param steps of the Runge-Kutta method in a substep
  std::vector<Tilt> plan(const LawMoments& start, double clock, double length, std::size_t substeps,
                         unsigned steps, const Final& final_tilt);
  /// Of the last plan: ref_K.
  const LawMoments& last_reference() const { return reference_.back(); }

 private:
  struct Transition {
    Eigen::MatrixXd F, Q;
    Eigen::VectorXd g;  ///< image of the reference mean
  };
  Transition linearise(const LawMoments& law, double clock, double length, unsigned steps);
  void flow(Batch& x, double clock, double length, unsigned steps);

  const Model& model_;
  const MomentEquations& equations_;
  MomentEquations::Scratch scratch_;
  Batch x_, k_[4], stage_;
  std::vector<LawMoments> reference_;
};

/// The tilt that turns the first two moments of one law into those of another, where that narrows it: the rest is
/// left as it is.
Tilt tilt_between(const LawMoments& from, const LawMoments& to);

}  // namespace wienertree
