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

}  // namespace

std::vector<std::vector<double>> kink_deviations(const Model& model,
                                                 const std::vector<KinkedFunction>& payoffs, double horizon,
                                                 std::optional<std::size_t> discount_state) {
  std::vector<std::vector<double>> deviations(payoffs.size());
  std::vector<BatchFunction> arguments = {
      [](ConstBatchView, std::span<double> out) { std::fill(out.begin(), out.end(), 1.0); }};
  for (const KinkedFunction& payoff : payoffs)
    for (const BatchFunction& kink : payoff.kinks) arguments.insert(arguments.end(), {kink, square_of(kink)});
  if (arguments.size() == 1) return deviations;
  WeakRun pilot;
  pilot.options.formula = construct_degree_3(static_cast<int>(model.noise_dimension()));
  pilot.options.nodes = 200;
  pilot.options.discount_state = discount_state;
  pilot.options.tolerance = {1e-5, 1e-7};
  pilot.horizon = horizon;
  pilot.steps = 8;
  const std::vector<double> moments = run_weak(model, arguments, pilot).value;
  const double mass = moments[0];  // below 1 where payoffs are discounted
  std::size_t at = 1;
  for (std::size_t i = 0; i < payoffs.size(); ++i)
    for (std::size_t k = 0; k < payoffs[i].kinks.size(); ++k, at += 2) {
      const double mean = moments[at] / mass, square = moments[at + 1] / mass;
      const double variance = square - mean * mean;
      // A kink whose argument does not vary lies to one side of it, or at its only value.
      const bool varies = variance > 1e-12 * square;
      deviations[i].push_back(varies ? std::sqrt(variance) : 1e-6 * (std::abs(mean) + 1e-6));
    }
  return deviations;
}

std::vector<BatchFunction> smooth_payoffs(const std::vector<KinkedFunction>& payoffs,
                                          const std::vector<std::vector<double>>& deviations, double width) {
  std::vector<BatchFunction> result;
  for (std::size_t i = 0; i < payoffs.size(); ++i) {
    std::vector<double> widths = deviations[i];
    for (double& w : widths) w *= width;
    result.push_back(widths.empty() || width == 0 ? payoffs[i].exact : payoffs[i].smoothed(widths));
  }
  return result;
}

}  // namespace wienertree
