#pragma once
/// A formula is trusted only after its moments have been computed and compared, word by word.
#include <functional>
#include <optional>
#include <string>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/signature.hpp"

namespace wienertree {

/// Largest error of a moment that a formula may have, in files as in constructions. Rounding of a product of
/// up to a dozen segments stays below 1e-14 (the shipped files reach 4e-15); 1e-12 leaves room for files with
/// 15 digits.
inline constexpr double moment_tolerance = 1e-12;

/// One moment: the weighted mean over the paths of the iterated integral over `word`, and what it should be.
struct MomentComparison {
  Word word;
  double value = 0, expected = 0;
};

struct FormulaVerification {
  int stated_degree = 0;
  double tolerance = moment_tolerance;
  double max_error = 0;  ///< over all words of degree <= stated_degree; infinite if a moment is not finite
  /// The first word (by degree, then lexicographically) whose error exceeds the tolerance.
  std::optional<MomentComparison> first_failure;
  /// The highest degree up to which every moment holds, -1 if the weights do not even sum to 1. Degrees above
  /// the stated one are tried until one fails or has more than GradedWords::limit words.
  int degree = -1;
  /// l2 norm of the moment errors over the words of degree exactly stated_degree + 1; absent if there are
  /// more than GradedWords::limit words of degree <= stated_degree + 1, or not asked for.
  std::optional<double> next_residual;

  bool holds() const { return !first_failure; }
  /// One line: "holds to degree 5 (largest error 2e-16, next residual 0.31)", or the first failing word and
  /// both values.
  std::string brief() const;
};

/// Checks what needs no moments: degree >= 1, dimension >= 1, at least one path, each with a finite positive
/// weight and at least one segment, all increments finite and 1+p in number. `where` opens the message (a
/// file or a name).
/// @throws InputError naming path and segment, numbered from 1
void check_structure(const CubatureFormula& formula, const std::string& where);

/// Computes all moments of a formula up to its stated degree, and, with `look_beyond`, those of the next
/// degrees.
/// @throws InputError if check_structure does, or if there are more than GradedWords::limit words
FormulaVerification verify(const CubatureFormula& formula, double tolerance = moment_tolerance,
                           bool look_beyond = true);

/// The same for anything whose mean signature can be computed: `mean(g)` returns its moments up to degree g.
FormulaVerification verify_moments(int stated_degree, int dimension,
                                   const std::function<TensorSeries(int degree)>& mean, double tolerance,
                                   bool look_beyond);

/// @throws InputError at `where` with the first failing word and both values, if there is one
void require_holds(const FormulaVerification& verification, const std::string& where);

/// Number of segments over all paths: one ODE is solved for each, for each node and step.
std::size_t total_segments(const CubatureFormula& formula);

}  // namespace wienertree
