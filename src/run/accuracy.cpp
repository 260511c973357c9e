#include "wienertree/run/accuracy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/cubature/catalogue.hpp"

namespace wienertree {
namespace {

// Times of two runs that mean the same row are the same number.
AnswerError difference(const LaunchesSummary& answer, const LaunchesSummary& other) {
  const PosteriorSummary &a = answer.mean, &b = other.mean;
  AnswerError e;
  e.log_evidence = std::abs(a.log_evidence - b.log_evidence);
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const double sd = std::max(a.sd[i], b.sd[i]);
    // A point: what is left of a variance after rounding.
    if (!(sd > 1e-12 * std::max(1.0, std::abs(a.mean[i])))) continue;
    e.mean = std::max(e.mean, std::abs(a.mean[i] - b.mean[i]) / sd);
    e.sd = std::max(e.sd, std::abs(a.sd[i] - b.sd[i]) / sd);
    e.quantile =
        std::max({e.quantile, std::abs(a.q05[i] - b.q05[i]) / sd, std::abs(a.q95[i] - b.q95[i]) / sd});
  }
  return e;
}

}  // namespace

AnswerError& AnswerError::operator+=(const AnswerError& o) {
  mean += o.mean;
  sd += o.sd;
  quantile += o.quantile;
  log_evidence += o.log_evidence;
  return *this;
}

AnswerError& AnswerError::operator*=(double factor) {
  mean *= factor;
  sd *= factor;
  quantile *= factor;
  log_evidence *= factor;
  return *this;
}

bool AnswerError::within(double tolerance) const {
  return mean <= tolerance && sd <= tolerance && quantile <= 2.5 * tolerance && log_evidence <= tolerance;
}

void exchange(StateArchive& archive, AnswerError& e) { archive(e.mean, e.sd, e.quantile, e.log_evidence); }

RowErrors differences(std::span<const LaunchesSummary> answer, std::span<const LaunchesSummary> other) {
  RowErrors errors(answer.size());
  std::size_t next = 0;
  std::vector<std::size_t> lacking;
  AnswerError last;
  for (std::size_t r = 0; r < answer.size(); ++r) {
    const double t = answer[r].mean.time;
    while (next < other.size() && other[next].mean.time < t) ++next;
    if (next == other.size() || other[next].mean.time != t) {
      lacking.push_back(r);
      continue;
    }
    last = errors[r] = difference(answer[r], other[next]);
    for (const std::size_t before : lacking) errors[before] = last;
    lacking.clear();
  }
  for (const std::size_t r : lacking) errors[r] = last;
  return errors;
}

AnswerError largest(const RowErrors& errors) {
  AnswerError most;
  for (const AnswerError& e : errors) {
    // Not a number is as large as can be.
    const auto raise = [](double& to, double value) {
      if (!(value <= to)) to = std::isnan(value) ? INFINITY : value;
    };
    raise(most.mean, e.mean);
    raise(most.sd, e.sd);
    raise(most.quantile, e.quantile);
    raise(most.log_evidence, e.log_evidence);
  }
  return most;
}

void add(RowErrors& errors, const RowErrors& more) {
  errors.resize(more.size());
  for (std::size_t r = 0; r < more.size(); ++r) errors[r] += more[r];
}

AnswerError rounding_error(const PosteriorSummary& s) {
  double scale = 0;
  for (std::size_t i = 0; i < s.mean.size(); ++i)
    if (s.sd[i] > 0) scale = std::max(scale, std::abs(s.mean[i]) / s.sd[i]);
  const double rounding = 1e-8 + 1e-9 * scale;
  return {rounding, rounding, 2 * rounding, 1e-8 * std::max(1.0, std::abs(s.log_evidence))};
}

std::string above_tolerance(const AnswerError& e, double tolerance) {
  return fmt::format(
      "the tolerance {:g} is not reached: errors up to {:.2g} in means, {:.2g} in standard deviations, "
      "{:.2g} in "
      "quantiles (in posterior standard deviations), {:.2g} in log evidence",
      tolerance, e.mean, e.sd, e.quantile, e.log_evidence);
}

std::optional<CubatureFormula> formula_of_degree(int degree, const Model& model,
                                                 const std::filesystem::path& formulas) {
  try {
    return find_formula(degree, static_cast<int>(model.noise_dimension()), formulas);
  } catch (const InputError&) {  // there is none
    return {};
  }
}

std::optional<CubatureFormula> other_degree(int degree, const Model& model,
                                            const std::filesystem::path& formulas) {
  auto other = formula_of_degree(degree + 2, model, formulas);
  return other ? other : formula_of_degree(degree - 2, model, formulas);
}

double work_of(const FilterStatistics& s, std::size_t dimension) {
  const auto d = static_cast<double>(dimension);
  return (1 + d / 4) * static_cast<double>(s.flow.node_segments) +
         (1 + d / 2) * static_cast<double>(s.children) + 40 * d * static_cast<double>(s.conditioned);
}

}  // namespace wienertree
