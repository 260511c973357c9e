#include "wienertree/weak/run.hpp"

#include <cmath>
#include <string>

#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

// Average and its standard error over launches, as they come (Welford 1962).
class Mean {
 public:
  void add(double x) {
    ++count_;
    const double before = x - mean_;
    mean_ += before / count_;
    squares_ += before * (x - mean_);
  }
  double value() const { return mean_; }
  double standard_error() const { return count_ > 1 ? std::sqrt(squares_ / (count_ - 1) / count_) : 0; }

 private:
  double count_ = 0, mean_ = 0, squares_ = 0;
};

void split(const std::vector<Mean>& means, std::vector<double>& value, std::vector<double>& error) {
  for (const Mean& mean : means) {
    value.push_back(mean.value());
    error.push_back(mean.standard_error());
  }
}

}  // namespace

bool is_random(const WeakOptions& options) {
  return options.thinning.method != ThinningMethod::none && !recombines(options.thinning.method);
}

double extrapolate(double coarse, double fine, std::size_t k, std::size_t n, int degree) {
  const double ratio = static_cast<double>(n) / static_cast<double>(k);
  return fine + (fine - coarse) / (std::pow(ratio, (degree - 1) / 2.0) - 1);
}

WeakResult run_weak(const Model& model, const std::vector<BatchFunction>& payoffs, const WeakRun& run) {
  if (run.launches == 0) throw InputError("must be at least 1", "launches", "0");
  if (run.richardson && run.steps < 2)
    throw InputError("extrapolation needs at least 2 steps", "richardson", std::to_string(run.steps));
  const Generation start = first_generation(model, run.options.nodes);
  const std::size_t coarse_steps = (run.steps + 1) / 2;
  std::vector<Mean> value(payoffs.size()), extrapolated(run.richardson ? payoffs.size() : 0);
  WeakResult result;
  WeakOptions options = run.options;
  const auto tree = [&](std::size_t steps) {
    options.grid = time_grid(run.grid, run.horizon, steps, run.gamma);
    WeakEstimate estimate = weak_approximation(model, start, payoffs, options);
    result.ode_solves += estimate.ode_solves;
    return estimate;
  };
  for (std::uint32_t launch = 0; launch < run.launches; ++launch) {
    options.launch = run.first_launch + launch;
    const WeakEstimate fine = tree(run.steps);
    result.leaves = fine.leaves;
    result.discarded = fine.discarded;
    for (std::size_t i = 0; i < payoffs.size(); ++i) value[i].add(fine.value[i]);
    if (!run.richardson) continue;
    const WeakEstimate coarse = tree(coarse_steps);
    for (std::size_t i = 0; i < payoffs.size(); ++i)
      extrapolated[i].add(
          extrapolate(coarse.value[i], fine.value[i], coarse_steps, run.steps, options.formula.degree));
  }
  split(value, result.value, result.standard_error);
  split(extrapolated, result.extrapolated, result.extrapolated_standard_error);
  return result;
}

}  // namespace wienertree
