#include "wienertree/study/error_measure.hpp"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

struct Mean {
  double sum = 0, squares = 0, count = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    ++count;
  }
  double value() const { return sum / count; }
};

bool is_root(ErrorMeasure measure) {
  return measure == ErrorMeasure::rmse || measure == ErrorMeasure::relative_rmse ||
         measure == ErrorMeasure::deviation;
}

// What is averaged; the variance of `deviation` is seen to apart.
double part_of(ErrorMeasure measure, const StudyRun& run) {
  const bool relative = measure == ErrorMeasure::relative || measure == ErrorMeasure::relative_rmse;
  if (relative && run.reference == 0)
    throw InputError("a relative error needs a reference that is not 0", "measure", "0");
  const double error = relative ? run.value / run.reference - 1 : run.value - run.reference;
  switch (measure) {
    case ErrorMeasure::value:
    case ErrorMeasure::deviation:
      return run.value;
    case ErrorMeasure::absolute:
    case ErrorMeasure::relative:
      return std::fabs(error);
    default:
      return error * error;
  }
}

// Squares about the mean of each path, scaled so that their mean over its M launches is the sample variance.
std::vector<StudyRun> about_their_means(std::span<const StudyRun> runs) {
  std::map<std::size_t, Mean> paths;
  for (const StudyRun& run : runs) paths[run.path].add(run.value);
  std::vector<StudyRun> squares;
  for (const StudyRun& run : runs) {
    const Mean& path = paths[run.path];
    if (path.count < 2)
      throw InputError("the deviation over launches needs at least two of them", "measure",
                       std::to_string(path.count));
    squares.push_back({std::pow(run.value - path.value(), 2) * path.count / (path.count - 1), 0, run.path});
  }
  return squares;
}

// One number for each independent part.
std::vector<double> independent_parts(ErrorMeasure measure, std::span<const StudyRun> runs) {
  std::map<std::size_t, Mean> paths;
  std::vector<double> launches;
  for (const StudyRun& run : runs) {
    launches.push_back(part_of(measure, run));
    paths[run.path].add(launches.back());
  }
  if (paths.size() == 1) return launches;
  std::vector<double> means;
  for (const auto& [path, mean] : paths) means.push_back(mean.value());
  return means;
}

}  // namespace

double student_quantile(double level, std::size_t degrees) {
  return boost::math::quantile(boost::math::students_t(static_cast<double>(degrees)), (1 + level) / 2);
}

MeasuredError measure_error(ErrorMeasure measure, std::span<const StudyRun> runs, double level) {
  if (runs.empty()) throw InputError("no run to measure the error of", "measure");
  std::vector<StudyRun> squares;
  if (measure == ErrorMeasure::deviation) squares = about_their_means(runs);
  const std::vector<double> parts = independent_parts(measure, squares.empty() ? runs : squares);
  Mean mean;
  for (const double part : parts) mean.add(part);
  const double m = mean.value(), count = mean.count, none = std::numeric_limits<double>::quiet_NaN();
  MeasuredError error{is_root(measure) ? std::sqrt(m) : m, none, none, runs.size()};
  if (parts.size() < 2) return error;
  double about = 0;
  for (const double part : parts) about += (part - m) * (part - m);
  const double spread = student_quantile(level, parts.size() - 1) * std::sqrt(about / (count - 1) / count);
  if (measure == ErrorMeasure::value) {
    error.low = m - spread;
    error.high = m + spread;
  } else if (m > 0) {
    const double factor = std::exp(spread / m * (is_root(measure) ? 0.5 : 1.0));
    error.low = error.value / factor;
    error.high = error.value * factor;
  }
  return error;
}

}  // namespace wienertree
