#pragma once
/// Truncated signatures in the tensor algebra over {e_0..e_p}, graded by ||alpha|| (words.hpp).
///
/// The signature of a path w is S(w) = sum_alpha (int dw^{a_1} .. dw^{a_k}) e_{a_1} (x) .. (x) e_{a_k}. By
/// Chen's identity (Chen 1957, Ann. of Math. 65, 163-178) the signature of a concatenation is the tensor
/// product of the signatures, and a straight segment with increment D has signature exp(D), whose coefficient
/// at a_1..a_k is D_{a_1} .. D_{a_k} / k!.
#include <Eigen/Core>
#include <span>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/words.hpp"

namespace wienertree {

/// sum_alpha c_alpha e_alpha over the words of degree <= m.
struct TensorSeries {
  GradedWords words;
  Eigen::VectorXd coefficients;  ///< one per word, in the order of `words`

  /// The zero series. @throws InputError as GradedWords
  TensorSeries(int p, int degree) : words(p, degree), coefficients(Eigen::VectorXd::Zero(words.size())) {}
  double operator[](std::span<const int> word) const { return coefficients[words.index(word)]; }
  double& operator[](std::span<const int> word) { return coefficients[words.index(word)]; }
};

/// Expected Stratonovich signature of (t, B) on [0,1]: exp(e_0 + 1/2 sum_i e_i (x) e_i) (Fawcett 2003,
/// thesis, Oxford; Lyons, Victoir 2004, Proc. R. Soc. Lond. A 460, 169-198). If alpha splits into r
/// consecutive blocks, each "0" or "ii", its coefficient is 2^{-(number of ii blocks)} / r!; otherwise 0.
/// @throws InputError as GradedWords
TensorSeries expected_signature(int p, int degree);

/// Signature of a piecewise linear path (over a step of length 1), words of degree <= `degree`.
/// @throws InputError as GradedWords
TensorSeries signature(const CubaturePath& path, int degree);

/// sum_j lambda_j S(w_j), summed with compensation (Neumaier 1974) so that rounding stays that of single
/// paths.
/// @throws InputError as GradedWords
TensorSeries mean_signature(const CubatureFormula& formula, int degree);

/// S <- exp(D) (x) S for D = sum_a D_a e_a, D: 1+p values. By Horner's rule
///     exp(D) S = S + D (S + D/2 (S + D/3 (S + ..))),
/// whose k-th level is needed only up to degree m - k + 1. `scratch` holds nothing between calls.
void multiply_by_exponential_from_left(std::span<const double> D, TensorSeries& S, Eigen::VectorXd& scratch);

/// a (x) b, truncated. @pre a.words == b.words
TensorSeries product(const TensorSeries& a, const TensorSeries& b);

/// exp(a) = sum_k a^k / k!, truncated. @pre the coefficient of the empty word is 0
TensorSeries exponential(const TensorSeries& a);

/// Running compensated sums of vectors: Neumaier's variant of Kahan's summation, componentwise.
class CompensatedSum {
 public:
  explicit CompensatedSum(Eigen::Index size)
      : sum_(Eigen::VectorXd::Zero(size)), lost_(Eigen::VectorXd::Zero(size)) {}
  /// Adds factor * terms.
  void add(double factor, const Eigen::VectorXd& terms);
  Eigen::VectorXd value() const { return sum_ + lost_; }

 private:
  Eigen::VectorXd sum_, lost_;
};

}  // namespace wienertree
