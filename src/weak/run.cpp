#include "wienertree/weak/run.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

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

namespace {

// The ends of the intervals that are cut into steps: horizons and jumps.
std::vector<double> ends_of_intervals(const WeakRun& run) {
  std::vector<double> ends = run.horizons.empty() ? std::vector{run.horizon} : run.horizons;
  const std::size_t horizons = ends.size();
  ends.insert(ends.end(), run.jumps.begin(), run.jumps.end());
  std::inplace_merge(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(horizons), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

// f_k of each interval.
std::vector<double> shares(const WeakRun& run, const std::vector<double>& ends) {
  std::vector<double> result;
  double before = 0;
  for (const double t : ends)
    result.push_back(std::exp2(
        std::round(std::log2((t - std::exchange(before, t)) / (run.jumps.empty() ? t : ends.back())))));
  return result;
}

std::size_t steps_of_share(std::size_t m, double share) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(m) * share));
}

bool is_one_interval(const WeakRun& run) { return run.horizons.size() < 2 && run.jumps.empty(); }

}  // namespace

std::vector<double> jumps_inside(const Model& model, double horizon) {
  std::vector<double> inside;
  for (const double jump : model.jumps())
    if (jump > 0 && jump < horizon) inside.push_back(jump);
  return inside;
}

std::size_t steps_of_level(const WeakRun& run, std::size_t m) {
  if (is_one_interval(run)) return m;
  std::size_t sum = 0;
  for (const double share : shares(run, ends_of_intervals(run))) sum += steps_of_share(m, share);
  return sum;
}

std::size_t level_of(const WeakRun& run) {
  if (is_one_interval(run)) return run.steps;
  double sum = 0;
  for (const double share : shares(run, ends_of_intervals(run))) sum += share;
  const double m = static_cast<double>(run.steps) / sum;
  // Extrapolation wants every interval to have twice the steps of the coarser tree: down to f_k = 1/4.
  const double multiple = run.richardson ? 8 : 1;
  return static_cast<std::size_t>(std::max(1.0, std::round(m / multiple)) * multiple);
}

void set_grid(const WeakRun& run, std::size_t m, WeakOptions& options) {
  options.report_at.clear();
  if (is_one_interval(run)) {
    options.grid = time_grid(run.grid, run.horizon, m, run.gamma);
    return;
  }
  for (std::size_t i = 0; i < run.horizons.size(); ++i)
    if (!(run.horizons[i] > (i == 0 ? 0 : run.horizons[i - 1])) || !std::isfinite(run.horizons[i]))
      throw InputError("times must be positive and ascend", "horizon", std::to_string(run.horizons[i]));
  if (run.grid != GridKind::uniform)
    throw InputError(run.jumps.empty() ? "has one time to shrink towards, not several"
                                       : "has no room for the jumps of inputs",
                     "grid", "kusuoka");
  options.grid.assign(1, 0.0);
  const std::vector<double> ends = ends_of_intervals(run), share = shares(run, ends);
  for (std::size_t k = 0; k < share.size(); ++k) {
    const double from = k == 0 ? 0 : ends[k - 1], length = ends[k] - from;
    const std::size_t n = steps_of_share(m, share[k]);
    for (std::size_t i = 1; i < n; ++i)
      options.grid.push_back(from + length * static_cast<double>(i) / static_cast<double>(n));
    options.grid.push_back(ends[k]);
    if (run.horizons.size() > 1 && std::binary_search(run.horizons.begin(), run.horizons.end(), ends[k]))
      options.report_at.push_back(options.grid.size() - 1);
  }
}

WeakResult run_weak(const Model& model, const std::vector<WeakPayoff>& payoffs, const WeakRun& run) {
  if (run.launches == 0) throw InputError("must be at least 1", "launches", "0");
  if (run.richardson && run.steps < 2)
    throw InputError("extrapolation needs at least 2 steps", "richardson", std::to_string(run.steps));
  const Generation start = first_generation(model, run.options.nodes);
  const std::size_t level = level_of(run), coarse_level = (level + 1) / 2;
  const std::size_t values = payoffs.size() * std::max<std::size_t>(1, run.horizons.size());
  std::vector<Mean> value(values), extrapolated(run.richardson ? values : 0);
  WeakResult result;
  WeakOptions options = run.options;
  const auto tree = [&](std::size_t steps) {
    set_grid(run, steps, options);
    WeakEstimate estimate = weak_approximation(model, start, payoffs, options);
    result.ode_solves += estimate.ode_solves;
    return estimate;
  };
  for (std::uint32_t launch = 0; launch < run.launches; ++launch) {
    options.launch = run.first_launch + launch;
    const WeakEstimate fine = tree(level);
    result.leaves = fine.leaves;
    result.carriers = fine.carriers;
    result.discarded = fine.discarded;
    for (std::size_t i = 0; i < values; ++i) value[i].add(fine.value[i]);
    if (!run.richardson) continue;
    const WeakEstimate coarse = tree(coarse_level);
    for (std::size_t i = 0; i < values; ++i)
      extrapolated[i].add(
          extrapolate(coarse.value[i], fine.value[i], coarse_level, level, options.formula.degree));
  }
  split(value, result.value, result.standard_error);
  split(extrapolated, result.extrapolated, result.extrapolated_standard_error);
  return result;
}

}  // namespace wienertree
