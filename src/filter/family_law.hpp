#pragma once
/// The law of a signal on the line as its families leave it: distribution function, density, quantiles.
#include <span>
#include <vector>

#include "wienertree/filter/family.hpp"
#include "wienertree/filter/hermite_rule.hpp"

namespace wienertree {

/// A sum of families, each in the coordinate z of its shape, x = m + sd u(z) (family.hpp):
///
/// - Smooth ones, whose density is N(mu, s^2) times a polynomial known at the n points of a Gauss-Hermite rule,
///   r(zeta) = sum_k c_k He_k(zeta), zeta = (z - mu)/s, c_k = sum_j w_j r_j He_k(zeta_j)/k!: with phi, Phi those of
///   N(0, 1) the distribution function of mass c_0 is
///
///       c_0 Phi(zeta) - phi(zeta) sum_{k >= 1} c_k He_{k-1}(zeta).
///
///   A family that nothing was observed of has c_0 alone.
/// - All others by a table of the distribution function and the density at the nodes of their adaptive quadrature,
///   between which a cubic takes both (Hermite's interpolation).
/// - Families of sd 0 are points.
class FamilyLaw {
 public:
  void clear();
  /// @param log_ratio  log r_j at the points of the rule  @param log_weight of the family, with the mass of r left out
  void add_smooth(const Families& prior, std::size_t family, double mu, double s, double log_weight,
                  const HermiteRule& rule, std::span<const double> log_ratio);
  /// @param z ascending  @param below the part of the mass below each, from 0 to 1  @param density its derivative
  void add_table(const Families& prior, std::size_t family, double log_weight, std::span<const double> z,
                 std::span<const double> below, std::span<const double> density);
  /// Unobserved families. Replaces what was there.
  void set(const Families& families);

  std::size_t size() const { return mean_.size(); }
  /// Makes the mass 1 and leaves out what has less than 1e-15 of it; to be called before what follows.
  void normalise(const LineBounds& bounds);
  double distribution(double x) const;
  double density(double x) const;
  bool has_density() const { return !points_; }
  /// For ascending levels in (0, 1); inside the bounds.
  void quantiles(std::span<const double> levels, std::span<double> out) const;
  void exchange(StateArchive& archive);

 private:
  void append(const Families& prior, std::size_t family, double log_weight, double mu, double s);
  double below(std::size_t i, double z) const;
  double density_of_z(std::size_t i, double z) const;
  double quantile(double level, double start) const;

  std::vector<double> log_weight_, mean_, sd_, a_, c_, d_, mu_, s_;
  std::vector<std::uint64_t> first_ = {0};  ///< of each family's numbers; one more than families
  std::vector<std::uint8_t> table_;         ///< whether they are a table, or else coefficients
  std::vector<double> numbers_;             ///< c_0 .. c_{n-1}, or z, below, density
  std::vector<double> weight_;              ///< of sum 1
  double low_ = 0, high_ = 0, centre_ = 0, width_ = 0;
  bool points_ = false;
};

}  // namespace wienertree
