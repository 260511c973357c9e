#include "wienertree/model/text/exact_filter.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "wienertree/model/text/affine_form.hpp"

namespace wienertree::text {

namespace {

// The value at one point of the states.
double value_at(Expression e, std::size_t d, std::span<const double> x) {
  TapeBuilder builder(d, 0);
  TapeSymbols symbols;
  for (std::size_t i = 0; i < d; ++i) symbols.states.push_back(builder.input(i));
  const TapeBuilder::Value output = emit(e, symbols, builder);
  std::vector<const double*> inputs;
  for (std::size_t i = 0; i < d; ++i) inputs.push_back(&x[i]);
  double result = 0;
  double* const results = &result;
  builder.finish(std::span(&output, 1)).evaluate(inputs, {}, std::span(&results, 1), 1);
  return result;
}

std::string component_name(const ExactFilterQuestion& question, std::size_t i) {
  return question.model.state_names[i];
}

/// Empty when it holds, else what differs.
using Difference = std::string;

Difference bounds(const ExactFilterQuestion& question) {
  for (std::size_t i = 0; i < question.model.bounds.size(); ++i)
    if (question.model.bounds[i].bounded())
      return fmt::format("state.{} is bounded", component_name(question, i));
  return {};
}

Difference not_linear_gaussian(const ExactFilterQuestion& question) {
  const FieldExpressions& bound = question.bound;
  if (Difference difference = bounds(question); !difference.empty()) return difference;
  if (question.model.inputs) return "there are inputs";
  for (std::size_t i = 0; i < bound.d; ++i)
    for (std::size_t j = 1; j <= bound.p; ++j)
      if (!bound.fields[j][i]->is_number())
        return fmt::format("diffusion.{}[{}] depends on the state: {}", component_name(question, i), j,
                           print(bound.fields[j][i]));
  for (std::size_t i = 0; i < bound.d; ++i)
    if (!affine_form(bound.ito_drift[i], bound.d))
      return fmt::format("drift.{} is not affine: {}", component_name(question, i),
                         print(bound.ito_drift[i]));
  for (std::size_t i = 0; i < bound.sensor.size(); ++i)
    if (!affine_form(bound.sensor[i], bound.d))
      return fmt::format("observation.h[{}] is not affine: {}", i + 1, print(bound.sensor[i]));
  return {};
}

Difference not_kalman_bucy(const ExactFilterQuestion& question) {
  if (question.model.observation != ObservationKind::continuous) return "the observation is not continuous";
  return not_linear_gaussian(question);
}

Difference not_kalman(const ExactFilterQuestion& question) {
  if (question.model.observation != ObservationKind::discrete) return "the observation is not discrete";
  for (Expression scale : question.bound.noise_scale)
    if (!scale->is_number())
      return fmt::format("the scale of observation.noise is not constant: {}", print(scale));
  if (question.model.density->gaussian_variances().empty()) return "observation.noise is not gaussian";
  return not_linear_gaussian(question);
}

// The drift compared with mu sigma tanh(mu x/sigma) at points on both sides and of all sizes, where mu is
// read off f'(0) = mu^2. The drift is an analytic function, so that agreement at these points, chosen without
// regard to it, is agreement everywhere but for an adversary. Rounding of the two sides is far below the
// tolerance of 1e-10 mu sigma, and a slope wrong by a relative 1e-9 is seen at z near 1.
Difference not_benes_drift(const ExactFilterQuestion& question, BenesParameters& parameters) {
  const Expression drift = question.bound.ito_drift[0];
  const std::string key = "drift." + component_name(question, 0);
  if (drift->is_number(0)) {
    parameters.mu = 0;
    return {};
  }
  if (is_piecewise(drift)) return fmt::format("{} is not analytic: {}", key, print(drift));
  const double origin = 0;
  const double slope = value_at(question.bound.jacobians[0][0], 1, {&origin, 1});
  if (!(slope > 0) || !std::isfinite(slope))
    return fmt::format("{} is no mu*sigma*tanh(mu*x/sigma): its slope at 0 is {} and not positive", key,
                       slope);
  parameters.mu = std::sqrt(slope);
  const double amplitude = parameters.mu * parameters.sigma;
  constexpr std::array sizes{0.0,  0.0031, 0.0173, 0.0917, 0.231, 0.4142, 0.577, 0.7321, 0.871, 1.0,
                             1.21, 1.4142, 1.618,  1.997,  2.718, 3.1416, 4.669, 6.2832, 11.3,  19.7};
  for (const double size : sizes)
    for (const double z : {size, -size}) {
      const double x = z * parameters.sigma / parameters.mu;
      const double given = value_at(drift, 1, {&x, 1}), benes = amplitude * std::tanh(z);
      if (!(std::abs(given - benes) <= 1e-10 * amplitude))
        return fmt::format(
            "{} at {} = {} is {}, and mu*sigma*tanh(mu*x/sigma) with mu = {}, sigma = {} is {}", key,
            component_name(question, 0), x, given, parameters.mu, parameters.sigma, benes);
    }
  return {};
}

Difference not_benes(const ExactFilterQuestion& question, BenesParameters& parameters) {
  const FieldExpressions& bound = question.bound;
  if (question.model.observation != ObservationKind::continuous) return "the observation is not continuous";
  if (bound.has_clock) return "a coefficient depends on the time t";
  if (bound.d != 1) return fmt::format("there are {} states, not 1", bound.d);
  if (bound.p != 1) return fmt::format("there are {} Brownian motions, not 1", bound.p);
  if (bound.sensor.size() != 1) return fmt::format("h has {} components, not 1", bound.sensor.size());
  if (question.model.initial_law) return "the start is random";
  if (Difference difference = bounds(question); !difference.empty()) return difference;
  const Expression sigma = bound.fields[1][0];
  if (!sigma->is_number() || sigma->is_number(0))
    return fmt::format("diffusion.{} is not a constant other than 0: {}", component_name(question, 0),
                       print(sigma));
  const std::optional<AffineForm> h = affine_form(bound.sensor[0], 1);
  if (!h) return fmt::format("observation.h[1] is not affine: {}", print(bound.sensor[0]));
  // The law of the signal depends on mu^2 and sigma^2 alone.
  parameters.sigma = std::abs(sigma->number);
  parameters.h1 = h->linear(0);
  parameters.h2 = h->constant;
  parameters.x0 = question.model.initial[0];
  return not_benes_drift(question, parameters);
}

std::string benes_reason(const BenesParameters& b) {
  return fmt::format("the drift is mu*sigma*tanh(mu*x/sigma) with mu = {}, sigma = {}, and h(x) = {}*x + {}",
                     b.mu, b.sigma, b.h1, b.h2);
}

ExactFilterAnswer answer(ExactFilter filter, const ExactFilterQuestion& question, Difference& difference) {
  ExactFilterAnswer result;
  BenesParameters parameters;
  switch (filter) {
    case ExactFilter::benes:
      difference = not_benes(question, parameters);
      result.benes = parameters;
      result.reason = benes_reason(parameters);
      break;
    case ExactFilter::kalman_bucy:
      difference = not_kalman_bucy(question);
      result.reason = "drift and h are affine, the diffusion is constant";
      break;
    case ExactFilter::kalman:
      difference = not_kalman(question);
      result.reason = "drift and h are affine, the diffusion is constant, the noise is gaussian";
      break;
    case ExactFilter::none:
      break;
  }
  result.filter = filter;
  return result;
}

}  // namespace

const char* name(ExactFilter filter) {
  switch (filter) {
    case ExactFilter::benes:
      return "benes";
    case ExactFilter::kalman_bucy:
      return "kalman-bucy";
    case ExactFilter::kalman:
      return "kalman";
    case ExactFilter::none:
      break;
  }
  return "none";
}

ExactFilterAnswer exact_filter(const ExactFilterQuestion& question) {
  if (question.source.exact) {
    const ExactClaim& claim = *question.source.exact;
    Difference difference;
    ExactFilterAnswer result = answer(claim.filter, question, difference);
    if (!difference.empty())
      throw InputError("this exact filter does not apply: " + difference, claim.location.text(),
                       name(claim.filter));
    return result;
  }
  if (question.model.observation == ObservationKind::none)
    return {ExactFilter::none, {}, "there is no observation"};
  const bool continuous = question.model.observation == ObservationKind::continuous;
  const std::vector<ExactFilter> candidates = continuous
                                                  ? std::vector{ExactFilter::kalman_bucy, ExactFilter::benes}
                                                  : std::vector{ExactFilter::kalman};
  std::string differences;
  for (const ExactFilter candidate : candidates) {
    Difference difference;
    ExactFilterAnswer result = answer(candidate, question, difference);
    if (difference.empty()) return result;
    differences += fmt::format("{}not {}: {}", differences.empty() ? "" : "; ", name(candidate), difference);
  }
  return {ExactFilter::none, {}, differences};
}

}  // namespace wienertree::text
