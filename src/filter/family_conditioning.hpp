#pragma once
/// Families conditioned on an observation: Bayes' rule for the measure sum_i w_i law(m_i + s_i u_i(z)) and a
/// density p(y | x).
///
/// With g_i(z) = log p(y | m_i + s_i u_i(z)) - z^2/2 a family's weight becomes w_i Z_i,
///
///     Z_i = (2 pi)^{-1/2} int exp(g_i(z)) dz.
///
/// Where g_i is smooth and concave this is n-point Gauss-Hermite quadrature about N(mu, s^2), which is fitted
/// until the ratio exp(g_i) / N(mu, s^2) is a polynomial of degree below n - 2 to 1e-3 of its mean: the
/// quadrature is then exact to about the square of that. mu and s come from the projection of F on Hermite
/// polynomials under the present N(mu, s^2) (posterior linearisation; Garcia-Fernandez, Svensson, Morelande,
/// Sarkka 2015, IEEE Trans. Signal Process. 63, 5561-5573); for linear sensors and Gaussian noise that is
/// Kalman's update, whatever the noise. All else (several modes, kinks, heavy tails, bounds) goes to
/// FamilyModes, which finds the modes and integrates adaptively.
#include "wienertree/filter/family_law.hpp"
#include "wienertree/filter/family_likelihood.hpp"
#include "wienertree/filter/family_modes.hpp"
#include "wienertree/filter/hermite_rule.hpp"

namespace wienertree {

/// What an observation made of the families.
struct FamilyUpdate {
  Families components;    ///< Gaussians with the mean and variance of each family, or of each of its modes
  FamilyLaw law;          ///< the same, exactly: for quantiles and densities
  LinePoints points;      ///< quadrature points of the law: what the next step starts from
  bool quadratic = true;  ///< every log-likelihood was quadratic in z, to rounding
  double far = 0;         ///< root mean square of z under the posterior
  double outside = 0;     ///< mass of the families beyond the bounds, averaged over the posterior
  /// Largest posterior mass of a family whose law fell apart into modes of 1 % of its mass or more that lie 3
  /// sd of the family or more apart.
  double divided = 0;
  void clear();
};

class FamilyConditioning {
 public:
  /// The model is kept by reference. @pre one state, and a clock if the model has one
  explicit FamilyConditioning(const Model& model);
  /// @param clock what the model's clock shows  @param window its observation, or none, which gives the
  /// points of the families themselves  @param points about as many are wanted, 7 a family at least
  /// @throws RunError naming the place if no weight is positive, or one is NaN or infinite at a family's mean
  void condition(const Families& prior, const ObservationWindow& window, double clock, std::size_t points,
                 FamilyUpdate& out);

 private:
  enum class Fit { accepted, again, hard };
  struct Active {
    std::size_t family;
    double mu, s;
  };
  const HermiteRule& rule_for(std::size_t families, std::size_t points);
  void place(const Families& prior, const HermiteRule& rule);
  Fit examine(const Families& prior, const HermiteRule& rule, Active& active, std::span<const double> F,
              int pass);
  bool concave(const HermiteRule& rule, std::span<const double> F) const;
  void add_smooth(const Families& prior, const HermiteRule& rule, const Active& active);
  void condition_hard(const Families& prior, std::size_t points);
  void finish(FamilyUpdate& out);

  FamilyLikelihood likelihood_;
  LineBounds bounds_;
  FamilyModes modes_;
  std::vector<HermiteRule> rules_;
  std::vector<Active> active_;
  std::vector<std::size_t> hard_;
  std::vector<double> ratio_, part_, table_z_, table_below_, table_density_;
  FamilyUpdate* out_ = nullptr;
  std::vector<double> far_, outside_,
      divided_;  ///< of each component: mean of z^2, mass beyond bounds, modes
};

}  // namespace wienertree
