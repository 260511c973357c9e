#include "wienertree/weak/run.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
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
  for (const double t : ends) {
    const double against = run.jumps.empty() ? std::sqrt(t * ends.back()) : ends.back();
    result.push_back(std::exp2(std::round(std::log2((t - std::exchange(before, t)) / against))));
  }
  return result;
}

bool is_one_interval(const WeakRun& run) { return run.horizons.size() < 2 && run.jumps.empty(); }

// Extrapolation wants every interval to have twice the steps of the coarser tree.
constexpr std::size_t multiple_to_extrapolate = 8;
constexpr std::size_t least_to_first_time = 4;

}  // namespace

std::vector<double> jumps_inside(const Model& model, double horizon) {
  std::vector<double> inside;
  for (const double jump : model.jumps())
    if (jump > 0 && jump < horizon) inside.push_back(jump);
  return inside;
}

std::vector<std::size_t> interval_steps(const WeakRun& run, std::size_t m) {
  if (is_one_interval(run)) return {m};
  std::vector<std::size_t> counts;
  for (const double share : shares(run, ends_of_intervals(run)))
    counts.push_back(std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(m) * share)));
  if (run.jumps.empty())
    counts.front() = run.kinks_at_times ? m : std::max(counts.front(), std::min(m, least_to_first_time));
  return counts;
}

std::vector<std::size_t> halved(std::vector<std::size_t> counts) {
  for (std::size_t& count : counts) count = (count + 1) / 2;
  return counts;
}

std::size_t steps_of_level(const WeakRun& run, std::size_t m) {
  const std::vector<std::size_t> counts = interval_steps(run, m);
  return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
}

std::size_t level_of(const WeakRun& run) {
  if (is_one_interval(run)) return run.steps;
  // Steps grow with the level: the first that has as many, or the one before it where that is nearer.
  const std::size_t multiple = run.richardson ? multiple_to_extrapolate : 1;
  std::size_t m = multiple;
  while (steps_of_level(run, m) < run.steps) m += multiple;
  const std::size_t before = m > multiple ? steps_of_level(run, m - multiple) : 0;
  return before > 0 && run.steps - before < steps_of_level(run, m) - run.steps ? m - multiple : m;
}

void set_grid(const WeakRun& run, const std::vector<std::size_t>& counts, WeakOptions& options) {
  options.report_at.clear();
  if (is_one_interval(run)) {
    options.grid = time_grid(run.grid, run.horizon, counts.front(), run.gamma);
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
  const std::vector<double> ends = ends_of_intervals(run);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const double from = k == 0 ? 0 : ends[k - 1], length = ends[k] - from;
    const std::size_t n = counts[k];
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
  const std::vector<std::size_t> fine_counts = interval_steps(run, level);
  std::vector<Mean> value(values), extrapolated(run.richardson ? values : 0);
  WeakResult result;
  WeakOptions options = run.options;
  const auto tree = [&](const std::vector<std::size_t>& counts) {
    set_grid(run, counts, options);
    WeakEstimate estimate = weak_approximation(model, start, payoffs, options);
    result.ode_solves += estimate.ode_solves;
    return estimate;
  };
  for (std::uint32_t launch = 0; launch < run.launches; ++launch) {
    options.launch = run.first_launch + launch;
    const WeakEstimate fine = tree(fine_counts);
    result.leaves = fine.leaves;
    result.carriers = fine.carriers;
    result.discarded = fine.discarded;
    for (std::size_t i = 0; i < values; ++i) value[i].add(fine.value[i]);
    if (!run.richardson) continue;
    const WeakEstimate coarse = tree(halved(fine_counts));
    for (std::size_t i = 0; i < values; ++i)
      extrapolated[i].add(
          extrapolate(coarse.value[i], fine.value[i], coarse_level, level, options.formula.degree));
  }
  split(value, result.value, result.standard_error);
  split(extrapolated, result.extrapolated, result.extrapolated_standard_error);
  return result;
}

}  // namespace wienertree
