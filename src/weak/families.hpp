#pragma once
/// Averages of payoffs with kinks and jumps over the leaves of a tree, family by family.
///
/// The leaves that descend from one node of the last step (of degree 5: of the last two steps, for the
/// lattice of one is too coarse) are a family. Where no argument of a kink can pass through 0 within a
/// family, the payoff is smooth there and its cubature is kept. Elsewhere
///
///     E f = sum_j w_j f_0(x_j) + integral of (f_theta(z) - f_0) phi(z) dz,
///
/// f_0 the smooth branch of the payoff that most of the family sees, f_theta the branch that holds at z, and
/// z the standard normal variable in which the argument u has the law of step_law.hpp. Branches become
/// functions of z by regression: their projections on the polynomials in u of degree up to 3, orthogonal on
/// the family, which the moments of the cubature formula are right for. Between the roots of the kinks the
/// integral is Gauss's rule. Where a branch is not finite on the other side (sqrt(max(u, 0))), the payoff
/// itself at u(z) takes its place. Kinks whose arguments differ by more than a function of u are integrated over
/// the plane of z and of the normalised rest of the second argument.
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "wienertree/model/batch_function.hpp"
#include "wienertree/tree/generation.hpp"
#include "wienertree/weak/step_law.hpp"

namespace wienertree {

/// A payoff's average, and how many leaves or families carry 99 % of the average of its modulus.
struct LeafAverage {
  double value = 0;
  std::size_t carriers = 0;
};

/// Over single leaves: sum_n w_n f(x_n).
LeafAverage average_over(const BatchFunction& payoff, const Generation& leaves);

class FamilyAverage {
 public:
  /// Leaf n belongs to family n mod `families` (see grow()).
  /// @param four whether the formula keeps fourth moments over a step well enough (degree >= 7)
  FamilyAverage(const Generation& leaves, std::size_t families, bool four);

  /// @pre at most 64 kinks
  LeafAverage operator()(const KinkedFunction& payoff);

 private:
  using Sides = std::uint64_t;  ///< bit k: argument k is positive

  /// Functions of the members of a family, orthonormal under its weights.
  struct Basis {
    std::vector<std::vector<double>> functions;    ///< at the members
    std::vector<std::vector<double>> combination;  ///< each in the monomials
  };
  /// What an argument and all that differ from it by a constant share, as those of a strip of strikes do.
  struct FamilyShape {
    bool known = false;
    double least = 0, most = 0;
    StepLaw law;
    Basis basis;  ///< in powers of (u - mean) / deviation; empty until it is needed
  };
  struct ArgumentClass {
    std::vector<double> values;  ///< of the first argument, at the leaves
    std::vector<FamilyShape> families;
  };
  /// The class of argument k of a payoff, and what it has on top of the first one's.
  struct Membership {
    ArgumentClass* of = nullptr;
    double shift = 0;
  };

  void classify(std::size_t k);
  FamilyShape& shape_of(ArgumentClass& of);
  void take_family(std::size_t family);
  void take_argument(const KinkedFunction& payoff, std::size_t k, Sides sides);
  bool cross_somewhere(const KinkedFunction& payoff);
  double with_kinks(const KinkedFunction& payoff);
  double line_integral(const KinkedFunction& payoff);
  double plane_integral(const KinkedFunction& payoff);
  void build_basis(Basis& basis) const;
  void build_second(const KinkedFunction& payoff);
  void project(std::span<const double> values, std::span<double> coefficients) const;
  double at(std::span<const double> coefficients, double xi, double eta) const;
  const std::vector<double>& branch_values(const KinkedFunction& payoff, Sides sides);
  const std::vector<double>& argument_values(const KinkedFunction& payoff, std::size_t k, Sides sides);
  bool singular(const KinkedFunction& payoff, Sides sides);
  const std::vector<double>& branch_fit(const KinkedFunction& payoff, Sides sides);
  const std::vector<double>& argument_fit(const KinkedFunction& payoff, std::size_t k, Sides sides);
  Sides sides_at(const KinkedFunction& payoff, double xi, double eta);
  double argument_at(const KinkedFunction& payoff, std::size_t k, double xi, double eta);
  double direct_value(const KinkedFunction& payoff, double u, double xi);

  const Generation& leaves_;
  std::size_t families_, members_;
  bool four_;
  std::vector<double> weight_;  ///< of the leaves
  std::size_t family_ = 0;
  std::deque<ArgumentClass> classes_;
  // Of the payoff: values at all leaves.
  std::vector<double> exact_;
  std::vector<std::vector<double>> argument_;
  std::vector<Membership> member_;
  std::map<Sides, std::vector<double>> branch_;
  std::map<Sides, bool> singular_;
  std::map<std::pair<std::size_t, Sides>, std::vector<double>> argument_branch_;
  BatchFunction direct_;  ///< with_argument of `direct_kink_`
  std::size_t direct_kink_ = 0;
  // Of the family.
  double mass_ = 0;
  std::vector<double> w_, values_, xi_, eta_;
  std::vector<StepLaw> law_;
  std::vector<std::uint8_t> crosses_;
  Sides fixed_ = 0;     ///< sides of the kinks that do not cross
  Sides crossing_ = 0;  ///< kinks that do
  std::size_t main_ = 0;
  bool plane_ = false;
  Basis own_basis_;
  const Basis* basis_ = nullptr;
  std::map<Sides, std::vector<double>> branch_fit_;
  std::map<std::pair<std::size_t, Sides>, std::vector<double>> argument_fit_;
  Batch states_, further_;
};

}  // namespace wienertree
