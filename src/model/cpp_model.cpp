#include "wienertree/model/cpp_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace wienertree {
namespace {

std::string place(const Model& model) { return fmt::format("model {}", model.name); }

std::vector<std::string> default_names(std::size_t d, bool has_clock) {
  std::vector<std::string> names;
  const std::size_t proper = has_clock ? d - 1 : d;
  for (std::size_t i = 1; i <= proper; ++i)
    names.push_back(proper == 1 ? fmt::format("x") : fmt::format("x{}", i));
  if (has_clock) names.push_back(fmt::format("t"));
  return names;
}

ObservationKind default_observation(const Model& model) {
  if (model.density) return ObservationKind::discrete;
  return model.fields->sensor_dimension() > 0 ? ObservationKind::continuous : ObservationKind::none;
}

Model complete(std::shared_ptr<const VectorFields> fields, ModelDescription description) {
  Model model;
  model.name = std::move(description.name);
  model.fields = std::move(fields);
  const std::size_t d = model.state_dimension();
  model.has_clock = description.has_clock;
  model.state_names = std::move(description.state_names);
  if (model.state_names.empty()) model.state_names = default_names(d, model.has_clock);
  model.bounds = std::move(description.bounds);
  if (model.bounds.empty()) model.bounds.resize(d);
  model.density = std::move(description.density);
  model.timing = description.timing;
  model.observation = description.observation.value_or(default_observation(model));
  model.initial = std::move(description.initial);
  model.initial_law = std::move(description.initial_law);
  if (model.initial.empty() && model.initial_law)
    model.initial.assign(model.initial_law->mean.begin(), model.initial_law->mean.end());
  model.benes = description.benes;
  return model;
}

void check_observation(const Model& model) {
  if (model.observation == ObservationKind::discrete && !model.density)
    throw InputError("discrete observations need a density", place(model));
  if (model.observation == ObservationKind::continuous && model.fields->sensor_dimension() == 0)
    throw InputError("continuous observations need a sensor", place(model));
}

void check_initial_law(const Model& model) {
  if (!model.initial_law) return;
  const auto d = static_cast<Eigen::Index>(model.state_dimension());
  const InitialLaw& law = *model.initial_law;
  if (law.mean.size() != d || law.covariance.rows() != d || law.covariance.cols() != d)
    throw InputError("the mean needs d entries and the covariance d x d", place(model) + ": initial_law",
                     fmt::format("d = {}, mean {}, covariance {} x {}", d, law.mean.size(),
                                 law.covariance.rows(), law.covariance.cols()));
}

/// A state stays on an absorbing bound only if nothing moves it from there.
void check_absorbing_bounds(const Model& model) {
  const std::size_t d = model.state_dimension(), p = model.noise_dimension();
  for (std::size_t i = 0; i < d; ++i) {
    if (model.bounds[i].boundary != Boundary::absorb) continue;
    for (const double bound : {model.bounds[i].lower, model.bounds[i].upper}) {
      if (!std::isfinite(bound)) continue;
      Batch x(d, 1), drift(d, 1), V(d * p, 1);
      for (std::size_t l = 0; l < d; ++l) x(l, 0) = l == i ? bound : model.initial[l];
      model.fields->ito_drift(x, drift);
      model.fields->diffusion(x, V);
      bool rests = drift(i, 0) == 0.0;
      for (std::size_t j = 0; j < p; ++j) rests = rests && V(i * p + j, 0) == 0.0;
      if (!rests)
        throw InputError(
            "the coefficients of an absorbed state must be 0 on its bound, by a factor step(x - lower) say",
            fmt::format("{}: state {}", place(model), model.state_names[i]), fmt::format("{}", bound));
    }
  }
}

bool is_linear_gaussian(const Model& model) {
  const AffineFields* fields = model.fields->affine_fields();
  return fields && model.fields->affine_sensor() &&
         std::all_of(fields->linear.begin() + 1, fields->linear.end(),
                     [](const auto& A) { return A.isZero(0); }) &&
         std::none_of(model.bounds.begin(), model.bounds.end(),
                      [](const StateBound& b) { return b.bounded(); });
}

/// The coefficients against  V_0 = mu sigma tanh(mu x/sigma), V_1 = sigma, h = h1 x + h2  on 65 points around
/// x0, to 1e-12 of their size: a few roundings and an elementary function's 4 ulp.
void check_benes(const Model& model) {
  const auto fail = [&](const std::string& what) {
    throw InputError("the Benes filter does not apply: " + what, place(model));
  };
  if (!model.benes) fail("its parameters are not given");
  if (model.state_dimension() != 1 || model.noise_dimension() != 1 ||
      model.observation != ObservationKind::continuous || model.fields->sensor_dimension() != 1)
    fail("it needs one state, one Brownian motion and one continuously observed component");
  const BenesParameters& b = *model.benes;
  if (model.initial_law || model.initial[0] != b.x0) fail("the signal must start at x0");
  if (model.bounds[0].bounded()) fail("the state is bounded");
  constexpr std::size_t points = 65;
  Batch x(1, points), drift(1, points), V(1, points), h(1, points);
  for (std::size_t n = 0; n < points; ++n)
    x(0, n) = b.x0 + std::abs(b.sigma) * (static_cast<double>(n) - 32.0) / 4.0;
  model.fields->ito_drift(x, drift);
  model.fields->diffusion(x, V);
  model.fields->sensor(x, h);
  for (std::size_t n = 0; n < points; ++n) {
    const double z = x(0, n);
    const auto check = [&](const char* name, double found, double expected, double size) {
      if (!(std::abs(found - expected) <= 1e-12 * size))
        fail(fmt::format("{} is {} at x = {} instead of {}", name, found, z, expected));
    };
    check("the drift", drift(0, n), b.mu * b.sigma * std::tanh(b.mu * z / b.sigma), std::abs(b.mu * b.sigma));
    check("the diffusion", V(0, n), b.sigma, std::abs(b.sigma));
    check("h", h(0, n), b.h1 * z + b.h2, std::abs(b.h1 * z) + std::abs(b.h2));
  }
}

/// The exact filter that is claimed, if it applies; without a claim the Kalman filter that applies, if any.
ExactFilter settled_exact_filter(const Model& model, std::optional<ExactFilter> claim) {
  const bool gaussian_noise = model.density && !model.density->gaussian_variances().empty();
  ExactFilter applies = ExactFilter::none;
  if (is_linear_gaussian(model)) {
    if (model.observation == ObservationKind::continuous) applies = ExactFilter::kalman_bucy;
    if (model.observation == ObservationKind::discrete && gaussian_noise) applies = ExactFilter::kalman;
  }
  if (!claim) return applies;
  if (*claim == ExactFilter::benes) check_benes(model);
  if ((*claim == ExactFilter::kalman || *claim == ExactFilter::kalman_bucy) && *claim != applies)
    throw InputError(
        "the claimed exact filter needs affine fields with constant diffusion, an affine sensor, no bounds, "
        "and "
        "continuous observations or gaussian noise",
        place(model), *claim == ExactFilter::kalman ? "kalman" : "kalman-bucy");
  return *claim;
}

}  // namespace

Model make_model(std::shared_ptr<const VectorFields> fields, ModelDescription description) {
  const std::optional<ExactFilter> claim = description.exact_filter;
  Model model = complete(std::move(fields), std::move(description));
  check(model);
  check_observation(model);
  check_initial_law(model);
  check_absorbing_bounds(model);
  model.exact_filter = settled_exact_filter(model, claim);
  return model;
}

}  // namespace wienertree
