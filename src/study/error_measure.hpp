#pragma once
/// What many runs say of a method's error: one number with its confidence interval.
#include <cstddef>
#include <span>

namespace wienertree {

/// v the value of a run, r the reference.
enum class ErrorMeasure {
  value,          ///< mean of v
  absolute,       ///< mean of |v - r|
  relative,       ///< mean of |v/r - 1|
  rmse,           ///< root of the mean of (v - r)^2
  relative_rmse,  ///< root of the mean of (v/r - 1)^2
  deviation,      ///< root of the mean over the paths of the variance of v over the launches
};

/// One run: a launch on an observation path.
struct StudyRun {
  double value = 0, reference = 0;
  std::size_t path = 0;
};

struct MeasuredError {
  double value = 0;
  double low = 0, high = 0;  ///< confidence interval; NaN where nothing tells the spread
  std::size_t runs = 0;
};

/// Averages over launches, then over paths. The interval comes from the spread of the independent parts: the
/// observation paths where there are several, else the launches. With m their mean, s its standard error and
/// t Student's quantile it is exp(log m +- t s/m), which stays positive and is symmetric on a logarithmic
/// axis, and half as wide in the logarithm for a root; for `value` it is m +- t s.
/// @param level of confidence, in (0,1)
/// @throws InputError if there is no run, a relative measure meets a reference of 0, or `deviation` has a
/// path with fewer than two launches
MeasuredError measure_error(ErrorMeasure measure, std::span<const StudyRun> runs, double level = 0.95);

/// The number t with P(|T| <= t) = level for Student's law of so many degrees of freedom. @pre degrees >= 1
double student_quantile(double level, std::size_t degrees);

}  // namespace wienertree
