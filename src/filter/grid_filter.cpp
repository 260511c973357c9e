#include "wienertree/filter/grid_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/filter/places.hpp"

namespace wienertree {
namespace {

// Rounding errors of the density are below this part of its largest value; an observation may not leave more
// than `tolerated` of its likelihood to them.
constexpr double rounding = 1e-12, tolerated = 1e-6;
// The change of log density over a cell at which differences of order 8 still have four digits.
constexpr double roughest = 0.5;
// The first part of the first gap is passed in eight steps of 2^-7 of it on one grid. The shortest waves of
// the point mass shrink in each by the rational exponential's 7/z at z = sigma^2 s (pi/width)^2/2, about 550:
// to 1e-15 in all.
constexpr int point_steps = 8, point_halvings = 7;
constexpr int most_halvings = 40, most_repetitions = 30;
constexpr std::size_t fewest_points = 32;

const Model& checked(const Model& model, const FilterOptions& options) {
  const std::string where = "model " + model.name;
  if (model.state_dimension() != 1)
    throw InputError("the grid filter needs one state and coefficients without t", where,
                     fmt::format("{} components", model.state_dimension()));
  if (model.bounds[0].bounded() && model.bounds[0].boundary == Boundary::absorb)
    throw InputError("the grid filter has no absorbing bounds", where, "absorb");
  if (options.grid_points < fewest_points)
    throw InputError(fmt::format("must be at least {}", fewest_points), "grid points",
                     std::to_string(options.grid_points));
  if (!(options.grid_step > 0))
    throw InputError("must be positive", "grid step", fmt::format("{}", options.grid_step));
  return model;
}

}  // namespace

GridFilter::GridFilter(const Model& model, const FilterOptions& options)
    : model_(checked(model, options)),
      longest_step_(options.grid_step),
      start_(model.initial_law ? model.initial_law->mean(0) : model.initial[0]),
      density_(options.grid_points, model.bounds[0].lower, model.bounds[0].upper),
      before_(density_),
      fields_(model_),
      log_factor_(options.grid_points),
      correction_(options.grid_points) {
  if (!model.initial_law || model.initial_law->covariance(0, 0) == 0) return;
  density_.set_gaussian(start_, model.initial_law->covariance(0, 0));
  if (density_.touches_a_bound())
    throw InputError("the initial law reaches a bound of the state", "model " + model.name,
                     fmt::format("N({}, {})", start_, model.initial_law->covariance(0, 0)));
  spread_ = true;
}

void GridFilter::advance(const ObservationWindow& window) {
  if (window.at_start) weigh(window);
  if (model_.observation == ObservationKind::continuous) {
    const std::size_t k = model_.fields->sensor_dimension();
    slope_.resize(k);
    for (std::size_t r = 0; r + 1 < window.rows(); ++r) {
      const double gap = window.row_times[r + 1] - window.row_times[r];
      for (std::size_t i = 0; i < k; ++i)
        slope_[i] = (window.row_values[(r + 1) * k + i] - window.row_values[r * k + i]) / gap;
      evolve(gap, slope_, window);
    }
  } else if (window.length() > 0) {
    evolve(window.length(), {}, window);
  }
  if (!window.at_start) weigh(window);
  if (spread_ && roughness(density_) > roughest)
    throw RunError("the grid is too coarse for the density: more points are needed", place(window),
                   fmt::format("{} points", density_.grid().cells));
  posterior_.time = window.end;
  ++statistics_.steps;
}

// Steps are dyadic parts of the gap, so that few factorisations serve for many.
void GridFilter::evolve(double length, std::span<const double> slope, const ObservationWindow& window) {
  double passed = 0;  // of the gap; exact
  if (!spread_) {
    spread_point(length, slope, window);
    passed = std::ldexp(point_steps, -point_halvings);
  }
  while (passed < 1) {
    prepare_fields(window);
    const double halvings = std::ceil(std::log2(length * fields_.rate(density_) / longest_step_));
    if (!(halvings <= most_halvings))
      throw RunError("the density changes too fast", place(window),
                     fmt::format("rate {}", fields_.rate(density_)));
    double part = std::exp2(-std::max(0.0, halvings));
    while (passed + part > 1) part /= 2;
    guarded_step(part * length, slope, window);
    passed += part;
    if (density_.follow_mass()) fields_current_ = false;
  }
}

void GridFilter::spread_point(double length, std::span<const double> slope, const ObservationWindow& window) {
  const double s = std::ldexp(length, -point_halvings), time = s * point_steps;
  Batch x(1, 1), drift(1, 1), diffusion(model_.noise_dimension(), 1);
  x(0, 0) = start_;
  model_.fields->ito_drift(x, drift);
  if (model_.noise_dimension() > 0) model_.fields->diffusion(x, diffusion);
  double variance = 0;
  for (std::size_t r = 0; r < model_.noise_dimension(); ++r) variance += diffusion(r, 0) * diffusion(r, 0);
  if (!(variance > 0))
    throw RunError("the grid filter needs a signal that diffuses at its start", place(window),
                   fmt::format("{} = {}", model_.state_names[0], start_));
  density_.set_point(start_, 8 * std::sqrt(variance * time) + std::fabs(drift(0, 0)) * time);
  spread_ = true;
  fields_current_ = false;
  for (int i = 0; i < point_steps; ++i) {
    prepare_fields(window);
    guarded_step(s, slope, window);
  }
  if (density_.follow_mass()) fields_current_ = false;
}

void GridFilter::prepare_fields(const ObservationWindow& window) {
  if (fields_current_) return;
  fields_.read(density_.grid(), place(window));
  fokker_planck(density_.grid(), fields_.drift(), fields_.variance(), generator_);
  exponential_of_ = 0;
  fields_current_ = true;
}

void GridFilter::guarded_step(double s, std::span<const double> slope, const ObservationWindow& window) {
  before_ = density_;
  log_evidence_before_ = log_evidence_;
  for (int repetition = 0; repetition < most_repetitions; ++repetition) {
    step(s, slope, window);
    if (!density_.reaches_an_end()) return;
    before_.widen();
    density_ = before_;
    log_evidence_ = log_evidence_before_;
    fields_current_ = false;
    prepare_fields(window);
  }
  throw RunError("the mass runs away from the grid", place(window),
                 fmt::format("{} = {:g} .. {:g}", model_.state_names[0], density_.low(), density_.high()));
}

void GridFilter::step(double s, std::span<const double> slope, const ObservationWindow& window) {
  if (slope.empty()) return transport(s);
  const double noise = rounding * density_.largest();
  fields_.potential(slope, log_factor_, correction_);
  multiply(s / 6, noise, window);
  transport(s / 2);
  for (std::size_t n = 0; n < log_factor_.size(); ++n) log_factor_[n] -= s * s / 48 * correction_[n];
  multiply(2 * s / 3, noise, window);
  transport(s / 2);
  for (std::size_t n = 0; n < log_factor_.size(); ++n) log_factor_[n] += s * s / 48 * correction_[n];
  multiply(s / 6, noise, window);
}

// Times equal to a part in 1e10 share a factorisation: gaps between rows are differences of rounded times.
void GridFilter::transport(double s) {
  if (std::fabs(s - exponential_of_) > 1e-10 * s) {
    exponential_.assign(generator_, s);
    exponential_of_ = s;
  }
  exponential_.apply(density_.values());
}

// density <- density exp(factor log_factor) / mass, the mass going to the evidence. `noise`: values of the
// density below it are rounding errors.
void GridFilter::multiply(double factor, double noise, const ObservationWindow& window) {
  const std::span<double> rho = density_.values();
  double reference = -INFINITY;
  for (std::size_t n = 0; n < rho.size(); ++n)
    if (rho[n] > noise) reference = std::max(reference, log_factor_[n]);
  double sure = 0, unsure = 0;
  for (std::size_t n = 0; n < rho.size(); ++n) {
    const bool is_noise = rho[n] <= noise;
    // Where rounding errors would be raised by e^100 they are mass that is not there, whatever the factor.
    rho[n] *= std::exp(factor * std::min(log_factor_[n] - reference, 100 / factor));
    (is_noise ? unsure : sure) += std::fabs(rho[n]);
  }
  if (!(std::isfinite(reference) && sure > 0 && std::isfinite(sure + unsure)))
    throw RunError("the observation has no likelihood", place_and_observation(window));
  if (unsure > tolerated * sure)
    throw RunError("the observation lies where the density is below rounding errors",
                   place_and_observation(window));
  const double mass = density_.mass();
  density_.scale(1 / mass);
  log_evidence_ += factor * reference + std::log(mass);
}

// Where the likelihood is much narrower than the density, the grid is laid around their product first.
void GridFilter::weigh(const ObservationWindow& window) {
  if (window.observation.empty()) return;
  if (!spread_) {
    Batch x(1, 1);
    double term = 0;
    x(0, 0) = start_;
    model_.density->log_density(window.observation, x, {&term, 1});
    if (!std::isfinite(term))
      throw RunError("the observation has no likelihood", place_and_observation(window));
    log_evidence_ += term;
    return;
  }
  const double noise = rounding * density_.largest(), evidence = log_evidence_;
  before_ = density_;
  for (int repetition = 0; repetition < most_repetitions; ++repetition) {
    prepare_fields(window);
    model_.density->log_density(window.observation, fields_.nodes(), log_factor_);
    log_evidence_ = evidence;
    multiply(1, noise, window);
    if (!density_.is_narrow()) {
      if (density_.follow_mass()) fields_current_ = false;
      return;
    }
    const double around = 2 * density_.grid().width;
    density_.set_interpolated(before_, density_.low() - around, density_.high() + around);
    fields_current_ = false;
  }
  throw RunError("the likelihood is too narrow for the grid", place_and_observation(window));
}

const Posterior& GridFilter::posterior() {
  posterior_.log_evidence = log_evidence_;
  if (spread_) {
    const LineGrid& grid = density_.grid();
    points_.reshape(1, grid.cells);
    covariance_.reshape(1, 1);
    weight_.resize(grid.cells);
    for (std::size_t n = 0; n < grid.cells; ++n) points_(0, n) = grid.node(n);
    covariance_(0, 0) = grid.width * grid.width;
    gaussian_sum(density_, weight_, scratch_);
  } else {
    points_.reshape(1, 1);
    points_(0, 0) = start_;
    covariance_.reshape(0, 1);
    weight_.assign(1, 1.0);
  }
  posterior_.points = points_;
  posterior_.weight = weight_;
  posterior_.covariance = covariance_;
  posterior_.kept = weight_.size();
  return posterior_;
}

}  // namespace wienertree
