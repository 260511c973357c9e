#include "wienertree/filter/line_fields.hpp"

#include <fmt/format.h>

#include <cmath>

namespace wienertree {
namespace {

constexpr double negligible = 1e-10;  // of the largest value: leaves an expectation unchanged

// Calls add(i, density_i * width, s_i) at the inner nodes that matter, s = (log density)' by central
// differences.
template <class Add>
void for_mass(const LineDensity& density, Add add) {
  const std::span<const double> rho = density.values();
  const double threshold = negligible * density.largest(), width = density.grid().width;
  for (std::size_t i = 1; i + 1 < rho.size(); ++i)
    if (rho[i] > threshold) add(i, rho[i] * width, (rho[i + 1] - rho[i - 1]) / (2 * width * rho[i]));
}

}  // namespace

LineFields::LineFields(const Model& model)
    : fields_(model.fields.get()),
      sensors_(model.observation == ObservationKind::continuous ? fields_->sensor_dimension() : 0),
      state_name_(model.state_names[0]) {}

void LineFields::evaluate(const LineGrid& grid) {
  const std::size_t n = grid.cells, p = fields_->noise_dimension(), k = sensors_;
  nodes_.reshape(1, n);
  drift_.reshape(1, n);
  diffusion_.reshape(p, n);
  sensor_.reshape(k, n);
  derivative_.reshape(k * p, n);
  for (std::size_t i = 0; i < n; ++i) nodes_(0, i) = grid.node(i);
  fields_->ito_drift(nodes_, drift_);
  if (p > 0) fields_->diffusion(nodes_, diffusion_);
  if (k > 0) fields_->sensor(nodes_, sensor_);
  if (k * p > 0) fields_->sensor_derivative(nodes_, derivative_);
  variance_.assign(n, 0.0);
  for (std::size_t r = 0; r < p; ++r)
    for (std::size_t i = 0; i < n; ++i) variance_[i] += diffusion_(r, i) * diffusion_(r, i);
}

bool LineFields::nearly_constant(const LineGrid& grid, double b, double variance, double time) {
  evaluate(grid);
  const double sd = std::sqrt(variance * time);
  for (std::size_t i = 0; i < grid.cells; ++i)
    if (!(std::fabs(drift_(0, i) - b) * time <= sd && variance_[i] <= 4 * variance)) return false;
  return true;
}

void LineFields::read(const LineGrid& grid, const std::string& where) {
  evaluate(grid);
  for (std::size_t i = 0; i < grid.cells; ++i) {
    double total = drift_(0, i) + variance_[i];
    for (std::size_t j = 0; j < sensors_; ++j) total += sensor_(j, i);
    if (!std::isfinite(total))
      throw RunError(
          "a coefficient is not finite on the grid: bounds of the state keep the grid where they are", where,
          fmt::format("{} = {}", state_name_, nodes_(0, i)));
  }
}

void LineFields::potential(std::span<const double> slope, double bridge, std::span<double> U,
                           std::span<double> G) const {
  const std::size_t k = slope.size(), p = diffusion_.components();
  for (std::size_t n = 0; n < U.size(); ++n) {
    U[n] = 0;
    G[n] = 0;
    for (std::size_t i = 0; i < k; ++i) U[n] += sensor_(i, n) * (slope[i] - sensor_(i, n) / 2);
    for (std::size_t r = 0; r < p; ++r) {
      double derivative = 0;
      for (std::size_t i = 0; i < k; ++i) {
        const double Vh = derivative_(i * p + r, n);
        derivative += (slope[i] - sensor_(i, n)) * Vh;
        U[n] += bridge * Vh * Vh;
      }
      G[n] += derivative * derivative;
    }
  }
}

double LineFields::rate(const LineDensity& density) const {
  const std::span<const double> b = drift();
  const double width = density.grid().width;
  double diffusion = 0, contraction = 0, motion = 0, information = 0;
  for_mass(density, [&](std::size_t i, double mass, double s) {
    const double db = (b[i + 1] - b[i - 1]) / (2 * width);
    diffusion += mass * variance_[i] * s * s;
    contraction += mass * db * db;
    motion += mass * b[i] * b[i] * s * s;
  });
  for (std::size_t j = 0; j < sensor_.components(); ++j) {
    double first = 0, second = 0;
    for_mass(density, [&](std::size_t i, double mass, double) {
      first += mass * sensor_(j, i);
      second += mass * sensor_(j, i) * sensor_(j, i);
    });
    information += std::fmax(0.0, second - first * first);
  }
  return diffusion / 2 + std::sqrt(contraction) + std::sqrt(motion) / 4 + information;
}

double roughness(const LineDensity& density) {
  double sum = 0;
  for_mass(density, [&](std::size_t, double mass, double s) { sum += mass * s * s; });
  return std::sqrt(sum) * density.grid().width;
}

}  // namespace wienertree
