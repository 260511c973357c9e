#include "wienertree/filter/grid_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "wienertree/filter/places.hpp"

namespace wienertree {
namespace {

// Rounding errors of the density are below this part of its largest value; of the likelihood of an
// observation they may make up no more than `tolerated`.
constexpr double rounding = 1e-15, tolerated = 1e-5;
// The change of log density over a cell at which differences of order 8 still have four digits.
constexpr double roughest = 0.5;
// A point mass is spread in eight equal steps on one grid of 27 standard deviations, during which the mean
// moves by at most one. The shortest waves shrink in each by the rational exponential's 7/z at
// z = sigma^2 s (pi/width)^2/2, about 100 with 100 points and 1600 with 400.
constexpr int point_steps = 8, fewest_point_halvings = 7;
constexpr int most_halvings = 40, most_repetitions = 20;
constexpr std::size_t fewest_points = 32;

void require_halvings(double halvings, const ObservationWindow& window) {
  if (!(halvings <= most_halvings))
    throw RunError("the density changes too fast for the length of the step", place(window),
                   fmt::format("{} halvings", halvings));
}

const Model& checked(const Model& model, const FilterOptions& options) {
  const std::string where = "model " + model.name;
  if (model.state_dimension() != 1)
    throw InputError("the grid filter needs one state and coefficients without t", where,
                     fmt::format("{} components", model.state_dimension()));
  if (model.bounds[0].bounded() && model.bounds[0].boundary == Boundary::absorb)
    throw InputError("the grid filter has no absorbing bounds", where, "absorb");
  if (options.grid_points < fewest_points)
    throw InputError(fmt::format("must be at least {}", fewest_points), "nodes",
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
      // 1/2 |V h|^2 times the gap's part delta^2/6 of the window's bridge, over its length.
      bridge_ = window.bridge > 0 ? gap / 12 : 0;
      evolve(gap, slope_, window);
    }
  } else if (window.length() > 0) {
    evolve(window.length(), {}, window);
  }
  if (!window.at_start) weigh(window);
  posterior_.time = window.end;
  ++statistics_.steps;
}

// Steps are dyadic parts of the gap, so that few factorisations serve for many.
void GridFilter::evolve(double length, std::span<const double> slope, const ObservationWindow& window) {
  double passed = 0;  // of the gap; exact
  if (!spread_) {
    passed = spread_point(length, slope, window);
  }
  while (passed < 1) {
    prepare_fields(window);
    const double halvings = std::ceil(std::log2(length * fields_.rate(density_) / longest_step_));
    require_halvings(halvings, window);
    double part = std::exp2(-std::max(0.0, halvings));
    while (passed + part > 1) part /= 2;
    guarded_step(part * length, slope, window);
    passed += part;
    if (density_.follow_mass()) fields_current_ = false;
    if (!(roughness(density_) <= roughest))
      throw RunError("the grid is too coarse for the density: more points are needed", place(window),
                     fmt::format("{} points", density_.grid().cells));
  }
}

// Returns the part of the gap that was passed: so short that the coefficients hardly change over the grid.
double GridFilter::spread_point(double length, std::span<const double> slope,
                                const ObservationWindow& window) {
  Batch x(1, 1), drift(1, 1), diffusion(model_.noise_dimension(), 1);
  x(0, 0) = start_;
  model_.fields->ito_drift(x, drift);
  if (model_.noise_dimension() > 0) model_.fields->diffusion(x, diffusion);
  double variance = 0;
  for (std::size_t r = 0; r < model_.noise_dimension(); ++r) variance += diffusion(r, 0) * diffusion(r, 0);
  if (!(variance > 0))
    throw RunError("the grid filter needs a signal that diffuses at its start", place(window),
                   fmt::format("{} = {}", model_.state_names[0], start_));
  spread_ = true;
  for (int halvings = fewest_point_halvings;; ++halvings) {
    require_halvings(halvings, window);
    const double s = std::ldexp(length, -halvings), time = point_steps * s, sd = std::sqrt(variance * time);
    if (std::fabs(drift(0, 0)) * time > sd) continue;
    density_.set_point(start_, 8 * sd);
    if (!fields_.nearly_constant(density_.grid(), drift(0, 0), variance, time)) continue;
    fields_current_ = false;
    for (int i = 0; i < point_steps; ++i) {
      prepare_fields(window);
      guarded_step(s, slope, window);
    }
    if (density_.follow_mass()) fields_current_ = false;
    return time / length;
  }
}

void GridFilter::prepare_fields(const ObservationWindow& window) {
  if (!fields_current_) read_fields(place(window));
}

void GridFilter::read_fields(const std::string& where) {
  fields_.read(density_.grid(), where);
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
  statistics_.children += density_.grid().cells;
  if (slope.empty()) return transport(s);
  const double noise = rounding * density_.largest();
  fields_.potential(slope, bridge_, log_factor_, correction_);
  multiply(s / 6, noise, window);
  transport(s / 2);
  for (std::size_t n = 0; n < log_factor_.size(); ++n) log_factor_[n] -= s * s / 48 * correction_[n];
  multiply(2 * s / 3, noise, window);
  transport(s / 2);
  for (std::size_t n = 0; n < log_factor_.size(); ++n) log_factor_[n] += s * s / 48 * correction_[n];
  multiply(s / 6, noise, window);
}

// Times equal to a part in 1e10 share a factorisation: gaps between rows are differences of rounded times.
// The matrix conserves mass; restoring it keeps the rounding errors of many steps from adding up in the
// evidence.
void GridFilter::transport(double s) {
  if (std::fabs(s - exponential_of_) > 1e-10 * s) {
    exponential_.assign(generator_, s);
    exponential_of_ = s;
  }
  const double mass = density_.mass();
  exponential_.apply(density_.values());
  density_.scale(mass / density_.mass());
}

// density <- density exp(factor log_factor) / mass, the mass going to the evidence. Rounding errors of the
// size of `noise` at every node must not matter for the result.
void GridFilter::multiply(double factor, double noise, const ObservationWindow& window) {
  const std::span<double> rho = density_.values();
  double reference = -INFINITY;
  for (std::size_t n = 0; n < rho.size(); ++n)
    if (rho[n] > noise) reference = std::max(reference, log_factor_[n]);
  double total = 0, errors = 0;
  for (std::size_t n = 0; n < rho.size(); ++n) {
    const double ratio = std::exp(factor * (log_factor_[n] - reference));
    total += rho[n] *= ratio;
    errors += noise * ratio;
  }
  if (!std::isfinite(reference) || std::isnan(errors))
    throw RunError("the observation has no likelihood", place_and_observation(window));
  if (!(std::isfinite(errors) && errors <= tolerated * total))
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

// A factorisation serves for times that differ by rounding: it is that of the same time afterwards.
void GridFilter::exchange_state(StateArchive& archive) {
  bool fields_were_current = fields_current_;
  double exponential_was_of = exponential_of_;
  archive(spread_, density_, log_evidence_, posterior_.time, fields_were_current, exponential_was_of);
  if (!archive.reading()) return;
  fields_current_ = false;
  if (!fields_were_current) return;
  read_fields("checkpoint");
  if (!(exponential_was_of > 0)) return;
  exponential_.assign(generator_, exponential_was_of);
  exponential_of_ = exponential_was_of;
}

const Posterior& GridFilter::posterior() {
  posterior_.log_evidence = log_evidence_;
  if (spread_) {
    const LineGrid& grid = density_.grid();
    points_.reshape(1, grid.cells);
    covariance_.reshape(1, 1);
    weight_.resize(grid.cells);
    covariance_(0, 0) = grid.width * grid.width;
    density_.gaussian_sum(points_.component(0), weight_, scratch_);
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
