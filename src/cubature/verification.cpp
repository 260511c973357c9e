#include "wienertree/cubature/verification.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

std::string describe(const MomentComparison& moment) {
  if (moment.word.empty()) return fmt::format("the weights sum to {:.17g}, not to 1", moment.value);
  return fmt::format("the moment of the word \"{}\" is {:.17g}, expected {:.17g}", to_string(moment.word),
                     moment.value, moment.expected);
}

FormulaVerification compare_moments(const TensorSeries& mean, int stated_degree, double tolerance) {
  const GradedWords& words = mean.words;
  const TensorSeries expected = expected_signature(words.dimension(), words.degree());
  FormulaVerification result;
  result.stated_degree = stated_degree;
  result.tolerance = tolerance;
  bool all_hold = true;
  for (int g = 0; g <= words.degree(); ++g) {
    double squares = 0;
    for (auto i = words.first(g); i < words.first(g) + words.count(g); ++i) {
      const double value = mean.coefficients[i], target = expected.coefficients[i];
      double error = std::abs(value - target);
      if (std::isnan(error)) error = std::numeric_limits<double>::infinity();
      squares += error * error;
      all_hold = all_hold && error <= tolerance;
      if (g > stated_degree) continue;
      result.max_error = std::max(result.max_error, error);
      if (error > tolerance && !result.first_failure)
        result.first_failure = MomentComparison{words.word(i), value, target};
    }
    if (all_hold) result.degree = g;
    if (g == stated_degree + 1) result.next_residual = std::sqrt(squares);
  }
  return result;
}

}  // namespace

std::string FormulaVerification::brief() const {
  if (first_failure) return fmt::format("fails at degree {}: {}", degree + 1, describe(*first_failure));
  std::string line = fmt::format("holds to degree {} (largest error {:.2g}", degree, max_error);
  if (next_residual) line += fmt::format(", residual at degree {} {:.3g}", stated_degree + 1, *next_residual);
  return line + ")";
}

void check_structure(const CubatureFormula& formula, const std::string& where) {
  if (formula.degree < 1)
    throw InputError("the degree must be at least 1", where, fmt::format("{}", formula.degree));
  if (formula.dimension < 1)
    throw InputError("the dimension must be at least 1", where, fmt::format("{}", formula.dimension));
  if (formula.paths.empty()) throw InputError("a formula needs at least one path", where);
  for (std::size_t j = 0; j < formula.paths.size(); ++j) {
    const CubaturePath& path = formula.paths[j];
    const std::string here = fmt::format("{}: path {}", where, j + 1);
    if (!std::isfinite(path.weight) || path.weight <= 0)
      throw InputError("a weight must be positive and finite", here, fmt::format("{}", path.weight));
    if (path.increments.cols() == 0) throw InputError("a path needs at least one segment", here);
    if (path.increments.rows() != formula.dimension + 1)
      throw InputError(fmt::format("a segment of dimension {} has {} increments", formula.dimension,
                                   formula.dimension + 1),
                       here, fmt::format("{}", path.increments.rows()));
    for (Eigen::Index s = 0; s < path.increments.cols(); ++s) {
      for (const double increment : path.increments.col(s)) {
        if (!std::isfinite(increment))
          throw InputError("an increment must be finite", fmt::format("{}, segment {}", here, s + 1),
                           fmt::format("{}", increment));
      }
    }
  }
}

FormulaVerification verify_moments(int stated_degree, int dimension,
                                   const std::function<TensorSeries(int degree)>& mean, double tolerance,
                                   bool look_beyond) {
  const auto too_many = [&](int degree) {
    return GradedWords::count_up_to(dimension, degree) > GradedWords::limit;
  };
  int degree = stated_degree;
  if (look_beyond && !too_many(degree + 1)) ++degree;
  FormulaVerification result = compare_moments(mean(degree), stated_degree, tolerance);
  while (look_beyond && result.degree == degree && !too_many(degree + 1)) {
    ++degree;
    result.degree = compare_moments(mean(degree), stated_degree, tolerance).degree;
  }
  return result;
}

FormulaVerification verify(const CubatureFormula& formula, double tolerance, bool look_beyond) {
  check_structure(formula, formula.name);
  return verify_moments(
      formula.degree, formula.dimension, [&](int degree) { return mean_signature(formula, degree); },
      tolerance, look_beyond);
}

void require_holds(const FormulaVerification& verification, const std::string& where) {
  if (!verification.first_failure) return;
  throw InputError(fmt::format("the formula does not have its stated degree {}: {}",
                               verification.stated_degree, describe(*verification.first_failure)),
                   where);
}

std::size_t total_segments(const CubatureFormula& formula) {
  std::size_t segments = 0;
  for (const CubaturePath& path : formula.paths) segments += static_cast<std::size_t>(path.increments.cols());
  return segments;
}

}  // namespace wienertree
