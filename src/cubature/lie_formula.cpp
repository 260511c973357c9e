#include "wienertree/cubature/lie_formula.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

// Brackets of more letters than this have 2^(letters - 1) words; no formula needs half as many.
constexpr int max_letters = 16;

// bracket := letter | '[' bracket ',' bracket ']'
class BracketReader {
 public:
  BracketReader(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  LieBracket whole() {
    LieBracket bracket = next();
    skip_blanks();
    if (at_ != text_.size()) fail();
    return bracket;
  }

 private:
  LieBracket next() {
    skip_blanks();
    if (at_ < text_.size() && text_[at_] == '[') {
      if (++brackets_ >= max_letters) fail();  // also bounds the recursion
      ++at_;
      LieBracket left = next();
      take(',');
      LieBracket right = next();
      take(']');
      return LieBracket::of(std::move(left), std::move(right));
    }
    int letter = -1;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), letter);
    if (error != std::errc{} || letter < 0) fail();
    at_ = static_cast<std::size_t>(end - text_.data());
    return LieBracket::letter(letter);
  }

  void take(char c) {
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != c) fail();
    ++at_;
  }

  void skip_blanks() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }

  [[noreturn]] void fail() const {
    throw InputError(
        fmt::format(
            "a bracket is a letter or [bracket,bracket], of at most {} letters; error at character {}",
            max_letters, at_ + 1),
        where_, std::string(text_.substr(0, 60)));
  }

  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0;
  int brackets_ = 0;
};

}  // namespace

LieBracket LieBracket::letter(int letter) {
  LieBracket bracket;
  bracket.letter_ = letter;
  return bracket;
}

LieBracket LieBracket::of(LieBracket left, LieBracket right) {
  LieBracket bracket;
  bracket.parts_.push_back(std::move(left));
  bracket.parts_.push_back(std::move(right));
  return bracket;
}

LieBracket LieBracket::parse(std::string_view text, const std::string& where) {
  return BracketReader(text, where).whole();
}

int LieBracket::degree() const {
  return is_letter() ? GradedWords::weight(letter_) : left().degree() + right().degree();
}

int LieBracket::largest_letter() const {
  return is_letter() ? letter_ : std::max(left().largest_letter(), right().largest_letter());
}

std::string LieBracket::to_string() const {
  return is_letter() ? fmt::format("{}", letter_)
                     : fmt::format("[{},{}]", left().to_string(), right().to_string());
}

std::vector<std::pair<Word, double>> LieBracket::expand() const {
  if (is_letter()) return {{Word{letter_}, 1.0}};
  std::vector<std::pair<Word, double>> sum;
  const auto add_products = [&](const auto& a, const auto& b, double sign) {
    for (const auto& [u, x] : a) {
      for (const auto& [v, y] : b) {
        Word uv = u;
        uv.insert(uv.end(), v.begin(), v.end());
        sum.emplace_back(std::move(uv), sign * x * y);
      }
    }
  };
  const auto a = left().expand(), b = right().expand();
  add_products(a, b, 1);
  add_products(b, a, -1);
  return sum;
}

TensorSeries signature(const LieElement& element, int p, int degree) {
  TensorSeries L(p, degree);
  for (const LieTerm& term : element.terms) {
    if (term.bracket.degree() > degree) continue;
    for (const auto& [word, sign] : term.bracket.expand()) L[word] += sign * term.coefficient;
  }
  return exponential(L);
}

TensorSeries mean_signature(const LieFormula& formula, int degree) {
  TensorSeries S(formula.dimension, degree);
  CompensatedSum mean(S.words.size());
  for (const LieElement& element : formula.elements)
    mean.add(element.weight, signature(element, formula.dimension, degree).coefficients);
  S.coefficients = mean.value();
  return S;
}

void check_structure(const LieFormula& formula, const std::string& where) {
  if (formula.degree < 1)
    throw InputError("the degree must be at least 1", where, fmt::format("{}", formula.degree));
  if (formula.dimension < 1)
    throw InputError("the dimension must be at least 1", where, fmt::format("{}", formula.dimension));
  if (formula.elements.empty()) throw InputError("a formula needs at least one element", where);
  for (std::size_t j = 0; j < formula.elements.size(); ++j) {
    const LieElement& element = formula.elements[j];
    const std::string here = fmt::format("{}: element {}", where, j + 1);
    if (!std::isfinite(element.weight) || element.weight <= 0)
      throw InputError("a weight must be positive and finite", here, fmt::format("{}", element.weight));
    for (std::size_t k = 0; k < element.terms.size(); ++k) {
      const LieTerm& term = element.terms[k];
      const std::string place = fmt::format("{}, term {}", here, k + 1);
      if (!std::isfinite(term.coefficient))
        throw InputError("a coefficient must be finite", place, fmt::format("{}", term.coefficient));
      if (term.bracket.largest_letter() > formula.dimension)
        throw InputError(
            fmt::format("the letters of a formula of dimension {0} are 0 to {0}", formula.dimension), place,
            term.bracket.to_string());
    }
  }
}

FormulaVerification verify(const LieFormula& formula, double tolerance, bool look_beyond) {
  check_structure(formula, formula.name);
  return verify_moments(
      formula.degree, formula.dimension, [&](int degree) { return mean_signature(formula, degree); },
      tolerance, look_beyond);
}

namespace {

// Letters of a bracket formula: 0 .. p, then brackets in the order in which they are first met.
class Letters {
 public:
  explicit Letters(int p) {
    for (int i = 0; i <= p; ++i) known_.emplace(fmt::format("{}", i), known_.size());
    for (int i = 0; i <= p; ++i) degree_.push_back(GradedWords::weight(i));
  }
  std::size_t of(const LieBracket& bracket) {
    const std::string name = bracket.to_string();
    if (const auto found = known_.find(name); found != known_.end()) return found->second;
    const std::size_t left = of(bracket.left()), right = of(bracket.right()), letter = degree_.size();
    brackets_.emplace_back(left, right);
    degree_.push_back(bracket.degree());
    known_.emplace(name, letter);
    return letter;
  }
  const std::vector<int>& degree() const { return degree_; }
  std::vector<std::pair<std::size_t, std::size_t>> brackets() const { return brackets_; }

 private:
  std::map<std::string, std::size_t> known_;
  std::vector<int> degree_;
  std::vector<std::pair<std::size_t, std::size_t>> brackets_;
};

}  // namespace

BracketFormula bracket_formula(const LieFormula& formula) {
  check_structure(formula, formula.name);
  Letters letters(formula.dimension);
  for (const LieElement& element : formula.elements)
    for (const LieTerm& term : element.terms) letters.of(term.bracket);
  BracketFormula result{letters.brackets(), {}};
  const auto size = static_cast<Eigen::Index>(letters.degree().size());
  result.formula = {formula.name, formula.degree, static_cast<int>(size) - 1, formula.source, {}};
  for (const LieElement& element : formula.elements) {
    CubaturePath path{element.weight, Eigen::MatrixXd::Zero(size, 1), letters.degree()};
    for (const LieTerm& term : element.terms)
      path.increments(static_cast<Eigen::Index>(letters.of(term.bracket)), 0) += term.coefficient;
    result.formula.paths.push_back(std::move(path));
  }
  return result;
}

LieFormula construct_lie_5(const GaussianCubature& rule, double x) {
  if (!std::isfinite(x)) throw InputError("x must be finite", "construct_lie_5", fmt::format("{}", x));
  require_degree_5(rule);
  const Eigen::Index p = rule.points.rows();
  LieFormula formula{
      fmt::format("lyons-victoir-lie-5-{}", p),
      5,
      static_cast<int>(p),
      fmt::format(
          "Lyons, Victoir (2004), Proc. R. Soc. Lond. A 460, section 5, over a Gaussian rule of degree 5: {}",
          rule.source),
      {}};
  const auto e = [](Eigen::Index i) { return LieBracket::letter(static_cast<int>(i)); };
  const auto commute = [](LieBracket a, LieBracket b) { return LieBracket::of(std::move(a), std::move(b)); };
  for (Eigen::Index point = 0; point < rule.points.cols(); ++point) {
    const auto z = [&](Eigen::Index i) { return rule.points(i - 1, point); };
    const bool coincide = (rule.points.col(point).array() != 0).count() <= 1;
    for (const double sign : {1.0, -1.0}) {
      if (coincide && sign < 0) continue;
      LieElement element{coincide ? rule.weights[point] : rule.weights[point] / 2, {}};
      const auto add = [&](LieBracket bracket, double coefficient) {
        if (coefficient != 0) element.terms.push_back({std::move(bracket), coefficient});
      };
      const double a = sign > 0 ? x : 1 - x;
      add(e(0), 1);
      for (Eigen::Index i = 1; i <= p; ++i) add(e(i), z(i));
      for (Eigen::Index i = 1; i <= p; ++i) add(commute(commute(e(0), e(i)), e(i)), z(i) * z(i) / 12);
      for (Eigen::Index i = 1; i <= p; ++i) {
        for (Eigen::Index j = i + 1; j <= p; ++j) {
          add(commute(e(i), e(j)), sign * z(i) * z(j) / 2);
          add(commute(commute(e(i), e(j)), e(j)), a * z(i) * z(j) * z(j) / 6);
          add(commute(commute(e(j), e(i)), e(i)), (1 - a) * z(i) * z(i) * z(j) / 6);
        }
      }
      formula.elements.push_back(std::move(element));
    }
  }
  return formula;
}

LieFormula construct_lie_5(int p) {
  LieFormula formula = construct_lie_5(gaussian_cubature_5(p));
  require_holds(verify(formula, moment_tolerance, false), formula.name);
  return formula;
}

}  // namespace wienertree
