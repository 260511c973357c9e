#include "wienertree/filter/node_warnings.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace wienertree {
namespace {

constexpr double fewest_atoms = 5, farthest = 50, longest_step = 0.5;
// A start at a point has not spread over more nodes than these after its first steps.
constexpr std::size_t nodes_of_a_start = 100;

}  // namespace

void warn(std::vector<FilterWarning>& warnings, WarningKind kind, double time, std::string text) {
  if (std::ranges::any_of(warnings, [&](const FilterWarning& w) { return w.kind == kind; })) return;
  warnings.push_back({kind, time, std::move(text)});
}

void warn_of_model(const Model& model, std::vector<FilterWarning>& warnings) {
  const std::size_t d = model.reported_dimension(), p = model.noise_dimension(),
                    all = model.state_dimension();
  Batch x(all, 1), v(all, 1), sigma(all * p, 1);
  for (std::size_t i = 0; i < all; ++i) x(i, 0) = model.initial[i];
  model.fields->diffusion(x, sigma);
  std::size_t driven = 0;
  for (std::size_t i = 0; i < d; ++i) driven += p == 1 && sigma(i, 0) != 0 ? 1 : 0;
  if (p == 1 && d > 1 && driven == d)
    warn(warnings, WarningKind::shared_noise, 0,
         fmt::format("one Brownian motion drives all {} states: over a short step the law lies near a curve",
                     d));
  std::vector<double> drift_only(1 + p, 0.0);
  drift_only[0] = 1;
  for (std::size_t i = 0; i < d; ++i)
    for (const bool lower : {true, false}) {
      const double bound = lower ? model.bounds[i].lower : model.bounds[i].upper;
      if (!std::isfinite(bound)) continue;
      for (std::size_t j = 0; j < all; ++j) x(j, 0) = model.initial[j];
      x(i, 0) = bound;
      model.fields->direct(x, drift_only, v);
      if (std::isfinite(v(i, 0)) && (lower ? v(i, 0) < 0 : v(i, 0) > 0))
        warn(warnings, WarningKind::drift_leaves_bound, 0,
             fmt::format("the Stratonovich drift of {} at its bound {:g} is {:.3g}, which leads out of it",
                         model.state_names[i], bound, v(i, 0)));
    }
}

void warn_of_law(const Model& model, const Posterior& law, double effective_size,
                 std::vector<FilterWarning>& warnings) {
  if (effective_size < fewest_atoms && law.size() > nodes_of_a_start)
    warn(warnings, WarningKind::few_atoms, law.time,
         fmt::format("at t = {:g} the law hangs on {:.1f} effective nodes of {}", law.time, effective_size,
                     law.size()));
  constexpr double some_mass = 1e-3;
  for (std::size_t i = 0; i < model.reported_dimension(); ++i) {
    const StateBound& bound = model.bounds[i];
    if (!bound.bounded() || bound.boundary == Boundary::error) continue;
    double mass = 0;
    for (std::size_t n = 0; n < law.size(); ++n)
      if (law.points(i, n) <= bound.lower || law.points(i, n) >= bound.upper) mass += law.weight[n];
    if (mass > some_mass)
      warn(warnings, WarningKind::at_bound, law.time,
           fmt::format("at t = {:g} nodes at a bound of {} have the mass {:.2g}", law.time,
                       model.state_names[i], mass));
  }
}

void warn_of_reach(const Model& model, std::span<const double> y, double best, double time,
                   std::vector<FilterWarning>& warnings) {
  const std::vector<double> variance = model.density->gaussian_variances();
  if (variance.size() != y.size()) return;
  double peak = 0;
  for (std::size_t k = 0; k < y.size(); ++k)
    if (!std::isnan(y[k])) peak -= std::log(2 * std::numbers::pi * variance[k]) / 2;
  const double square = 2 * (peak - best);
  if (square > farthest)
    warn(warnings, WarningKind::out_of_reach, time,
         fmt::format(
             "the observation at t = {:g} is beyond the reach of all nodes: (y - h(x))^2/R is {:.3g} or more",
             time, square));
}

void warn_of_step(const Model& model, ConstBatchView node, double s, double time,
                  std::vector<FilterWarning>& warnings) {
  const std::size_t d = model.state_dimension();
  std::vector<double> drift_only(1 + model.noise_dimension(), 0.0);
  drift_only[0] = 1;
  Batch J(d * d, 1);
  model.fields->jacobian(node, drift_only, J);
  const auto size = static_cast<Eigen::Index>(d);
  Eigen::MatrixXd matrix(size, size);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t l = 0; l < d; ++l)
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(l)) = J(i * d + l, 0);
  if (!matrix.allFinite()) return;
  const double rate = -Eigen::EigenSolver<Eigen::MatrixXd>(matrix, false).eigenvalues().real().minCoeff();
  if (rate * s > longest_step)
    warn(warnings, WarningKind::step_exceeds_relaxation, time,
         fmt::format("at t = {:g} a step of {:.3g} is {:.2g} times the model's relaxation time", time, s,
                     rate * s));
}

}  // namespace wienertree
