#include "wienertree/weak/smoothing.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/weak/run.hpp"

namespace wienertree {
namespace {

BatchFunction square_of(const BatchFunction& f) {
  return [f](ConstBatchView x, std::span<double> out) {
    f(x, out);
    for (double& value : out) value *= value;
  };
}

// sum_j (grad u . V_j)^2, the variance that u gains per unit of time, by central differences.
BatchFunction variance_rate_of(const BatchFunction& u, std::shared_ptr<const VectorFields> fields,
                               double step) {
  return [u, fields, step](ConstBatchView x, std::span<double> out) {
    const std::size_t d = fields->state_dimension(), p = fields->noise_dimension(), n = x.nodes();
    Batch V(d * p, n), moved(d, n);
    fields->diffusion(x, V);
    std::vector<double> up(n), down(n);
    const auto value = [&](std::size_t j, double h, std::vector<double>& values) {
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t m = 0; m < n; ++m) moved(i, m) = x(i, m) + h * V(i * p + j, m);
      u(moved, values);
    };
    std::fill(out.begin(), out.end(), 0.0);
    for (std::size_t j = 0; j < p; ++j) {
      value(j, step, up);
      value(j, -step, down);
      for (std::size_t m = 0; m < n; ++m) {
        const double slope = (up[m] - down[m]) / (2 * step);
        out[m] += std::isfinite(slope) ? slope * slope : 0;
      }
    }
  };
}

}  // namespace

std::vector<std::vector<KinkScale>> kink_scales(const Model& model,
                                                const std::vector<KinkedFunction>& payoffs, double horizon,
                                                std::optional<std::size_t> discount_state) {
  std::vector<std::vector<KinkScale>> scales(payoffs.size());
  std::vector<WeakPayoff> arguments = {
      WeakPayoff([](ConstBatchView, std::span<double> out) { std::fill(out.begin(), out.end(), 1.0); })};
  for (const KinkedFunction& payoff : payoffs)
    for (const BatchFunction& kink : payoff.kinks) {
      arguments.emplace_back(kink);
      arguments.emplace_back(square_of(kink));
      arguments.emplace_back(variance_rate_of(kink, model.fields, 1e-4 * std::sqrt(horizon)));
    }
  if (arguments.size() == 1) return scales;
  WeakRun pilot;
  pilot.options.formula = construct_degree_3(static_cast<int>(model.noise_dimension()));
  pilot.options.nodes = 200;
  pilot.options.discount_state = discount_state;
  pilot.options.tolerance = {1e-5, 1e-7};
  pilot.horizon = horizon;
  pilot.steps = 8;
  pilot.jumps = jumps_inside(model, horizon);
  const std::vector<double> moments = run_weak(model, arguments, pilot).value;
  const double mass = moments[0];  // below 1 where payoffs are discounted
  std::size_t at = 1;
  for (std::size_t i = 0; i < payoffs.size(); ++i)
    for (std::size_t k = 0; k < payoffs[i].kinks.size(); ++k, at += 3) {
      const double mean = moments[at] / mass, square = moments[at + 1] / mass;
      const double variance = square - mean * mean;
      // A kink whose argument does not vary lies to one side of it, or at its only value.
      const bool varies = variance > 1e-12 * square;
      scales[i].push_back({varies ? std::sqrt(variance) : 1e-6 * (std::abs(mean) + 1e-6),
                           varies ? moments[at + 2] / mass * horizon / variance : 1});
    }
  return scales;
}

bool last_step_smooths(const std::vector<KinkScale>& scales) {
  return std::all_of(scales.begin(), scales.end(), [](const KinkScale& s) { return s.spread >= 0.02; });
}

BatchFunction smooth_payoff(const KinkedFunction& payoff, const std::vector<KinkScale>& scales,
                            double width) {
  if (payoff.kinks.empty() || width == 0) return payoff.exact;
  std::vector<double> widths;
  for (const KinkScale& scale : scales) widths.push_back(width * scale.deviation);
  return payoff.smoothed(widths);
}

}  // namespace wienertree
