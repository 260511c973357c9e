#pragma once
/// Cubature formulas whose nodes are Lie polynomials instead of paths.
///
/// Elements L_1..L_c of the free Lie algebra over e_0..e_p with weights lambda_j > 0 form a formula of degree
/// m if sum_j lambda_j exp(L_j) and the expected signature agree on all words of degree <= m (Lyons, Victoir
/// 2004, Proc. R. Soc. Lond. A 460, section 5). A step of length s along L moves a node for unit time along
/// the vector field that L becomes when e_i is replaced by V_i, [., .] by the Lie bracket, and a bracket of
/// degree g is multiplied by s^{g/2}.
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/cubature/signature.hpp"
#include "wienertree/cubature/verification.hpp"

namespace wienertree {

/// A letter, or [left, right] with brackets left and right: a binary tree.
class LieBracket {
 public:
  /// The letter e_i. @pre letter >= 0
  static LieBracket letter(int letter);
  static LieBracket of(LieBracket left, LieBracket right);
  /// "1", "[0,1]", "[[0,1],1]"; blanks are ignored.
  /// @throws InputError at `where` if the text is not a bracket
  static LieBracket parse(std::string_view text, const std::string& where);

  bool is_letter() const { return parts_.empty(); }
  int letter() const { return letter_; }                 ///< @pre is_letter()
  const LieBracket& left() const { return parts_[0]; }   ///< @pre !is_letter()
  const LieBracket& right() const { return parts_[1]; }  ///< @pre !is_letter()
  /// Sum of the degrees of the letters: 2 for a 0, 1 for any other.
  int degree() const;
  int largest_letter() const;
  std::string to_string() const;
  /// The bracket as a tensor, [a,b] = ab - ba: words with coefficients +-1, in no order, possibly repeated.
  std::vector<std::pair<Word, double>> expand() const;

 private:
  int letter_ = 0;
  std::vector<LieBracket> parts_;  // none or two
};

struct LieTerm {
  LieBracket bracket;
  double coefficient = 0;
};

/// L = sum of the terms.
struct LieElement {
  double weight = 0;  ///< lambda > 0
  std::vector<LieTerm> terms;
};

struct LieFormula {
  std::string name;
  int degree = 0;     ///< m
  int dimension = 0;  ///< p
  std::string source;
  std::vector<LieElement> elements;
};

/// exp(L) in the tensor algebra, words of degree <= `degree`. @throws InputError as GradedWords
TensorSeries signature(const LieElement& element, int p, int degree);

/// sum_j lambda_j exp(L_j). @throws InputError as GradedWords
TensorSeries mean_signature(const LieFormula& formula, int degree);

/// As for formulas of paths: degree and dimension >= 1, positive finite weights, finite coefficients,
/// letters <= p.
/// @throws InputError naming element and term, numbered from 1
void check_structure(const LieFormula& formula, const std::string& where);

/// @throws InputError as check_structure and GradedWords
FormulaVerification verify(const LieFormula& formula, double tolerance = moment_tolerance,
                           bool look_beyond = true);

/// A formula of Lie polynomials as straight lines: along the element sum_b c_b b a node moves for unit time
/// by the field sum_b c_b s^{g_b/2} V_b, one segment whose letters are 0 .. p and the brackets.
struct BracketFormula {
  /// The brackets that are letters p+1, p+2, ..: (i, j) is [V_i, V_j], of letters before it.
  std::vector<std::pair<std::size_t, std::size_t>> brackets;
  /// Of dimension p + number of brackets: it drives a model to which the brackets were added as fields. Its
  /// moments are those of the formula it was made from.
  CubatureFormula formula;
};
BracketFormula bracket_formula(const LieFormula& formula);

/// Degree 5 from a Gaussian rule of degree 5: each point z of weight mu gives two elements of weight mu/2,
///
///   L+- = e_0 + sum_i z_i^2/12 [[e_0,e_i],e_i] + sum_i z_i e_i +- 1/2 sum_{i<j} z_i z_j [e_i,e_j]
///         + a+- sum_{i<j} z_i z_j^2/6 [[e_i,e_j],e_j] + (1 - a+-) sum_{i<j} z_i^2 z_j/6 [[e_j,e_i],e_i],
///
/// a+ = x, a- = 1 - x for any x. Where at most one coordinate of z is not zero the two are one of weight mu.
/// @throws InputError as construct_ninomiya_victoir, or if x is not finite
LieFormula construct_lie_5(const GaussianCubature& rule, double x = 0.5);

/// construct_lie_5(gaussian_cubature_5(p)), verified. @throws InputError as gaussian_cubature_5
LieFormula construct_lie_5(int p);

}  // namespace wienertree
