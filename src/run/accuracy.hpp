#pragma once
/// How exact an answer is, as runs of other resolutions tell.
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "wienertree/run/launches.hpp"

namespace wienertree {

/// The largest difference of two answers over rows and states: of means, standard deviations and the 5 % and
/// 95 % quantiles in posterior standard deviations, of the log evidence as it is.
struct AnswerError {
  double mean = 0, sd = 0, quantile = 0, log_evidence = 0;
  AnswerError& operator+=(const AnswerError& other);
  AnswerError& operator*=(double factor);
  /// Means, standard deviations and log evidence within the tolerance E; quantiles within 2.5 E, which at the 5 %
  /// quantile of a Gaussian is a level within E/4.
  bool within(double tolerance) const;
};

void exchange(StateArchive& archive, AnswerError& error);

/// The same row by row, in the order of the rows.
using RowErrors = std::vector<AnswerError>;

/// What `other` differs from `answer`, at the times that both have; a row of `answer` whose time `other` lacks has
/// the difference of the next row that both have. Rows at which the law is a point (no standard deviation) count
/// with their log evidence alone.
RowErrors differences(std::span<const LaunchesSummary> answer, std::span<const LaunchesSummary> other);
/// The largest of each part.
AnswerError largest(const RowErrors& errors);
/// errors += more, row by row; an empty sum is a sum of zeros.
void add(RowErrors& errors, const RowErrors& more);

/// What a filter in closed form errs by: rounding to nine digits of its numbers in units of the standard deviation.
AnswerError rounding_error(const PosteriorSummary& row);

/// "the tolerance 0.02 is not reached: errors up to ..": a sentence for a warning.
std::string above_tolerance(const AnswerError& error, double tolerance);

/// The formula of this degree for the model's number of Brownian motions; nothing if there is none.
std::optional<CubatureFormula> formula_of_degree(int degree, const Model& model,
                                                 const std::filesystem::path& formulas);
/// The formula of degree m + 2 for the model's number of Brownian motions, or else of m - 2; nothing if there is
/// neither.
std::optional<CubatureFormula> other_degree(int degree, const Model& model,
                                            const std::filesystem::path& formulas);

/// Work in node-steps, counted by this table and never by the clock: moving a node of dimension d along a segment
/// costs 1 + d/4, weighing and thinning a child or moving a cell of a grid 1 + d/2, confronting a component with an
/// observation 40 d. A node-step takes about 0.1 microseconds of one core.
double work_of(const FilterStatistics& statistics, std::size_t dimension);

}  // namespace wienertree
