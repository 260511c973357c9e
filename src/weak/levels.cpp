#include "wienertree/weak/levels.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "wienertree/tree/initial.hpp"

namespace wienertree {

WeakLevels::WeakLevels(const Model& model, const std::vector<WeakPayoff>& payoffs, WeakRun run)
    : model_(model),
      payoffs_(payoffs),
      run_(std::move(run)),
      start_(first_generation(model, run_.options.nodes)) {}

std::vector<std::size_t> WeakLevels::counts_of(std::size_t n) const {
  const std::size_t base = base_ > 0 ? base_ : n;
  std::vector<std::size_t> counts = interval_steps(run_, base);
  for (std::size_t m = base; m > n; m = (m + 1) / 2) counts = halved(std::move(counts));
  for (std::size_t& count : counts) count *= std::max<std::size_t>(1, n / base);
  return counts;
}

const std::vector<WeakEstimate>& WeakLevels::trees(std::size_t n) {
  const std::vector<std::size_t> counts = counts_of(n);
  std::vector<WeakEstimate>& grown = trees_[counts];
  if (grown.size() < launches_) {
    WeakOptions options = run_.options;
    set_grid(run_, counts, options);
    while (grown.size() < launches_) {
      options.launch = static_cast<std::uint32_t>(grown.size());
      grown.push_back(weak_approximation(model_, start_, payoffs_, options));
      solves_ += grown.back().ode_solves;
    }
  }
  return grown;
}

std::vector<double> WeakLevels::value(std::size_t n) {
  const std::vector<WeakEstimate>& grown = trees(n);
  std::vector<double> mean = grown.front().value;
  for (const WeakEstimate& tree : grown)
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += (tree.value[i] - grown.front().value[i]) / launches_;
  return mean;
}

double WeakLevels::extrapolated(std::size_t n, std::size_t payoff, std::size_t launch) {
  const double fine = trees(n)[launch].value[payoff];
  if (n == 1) return fine;
  return extrapolate(trees(n / 2)[launch].value[payoff], fine, n / 2, n, run_.options.formula.degree);
}

std::vector<double> WeakLevels::extrapolated(std::size_t n) {
  // From the first one on, so that equal values have exactly their own as mean.
  std::vector<double> mean(trees(n).front().value.size());
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const double first = mean[i] = extrapolated(n, i, 0);
    for (std::uint32_t m = 1; m < launches_; ++m) mean[i] += (extrapolated(n, i, m) - first) / launches_;
  }
  return mean;
}

std::vector<double> WeakLevels::standard_error(std::size_t n) {
  std::vector<double> error(trees(n).front().value.size(), 0.0);
  if (launches_ == 1) return error;
  const std::vector<double> mean = extrapolated(n);
  for (std::size_t i = 0; i < error.size(); ++i) {
    for (std::uint32_t m = 0; m < launches_; ++m) error[i] += std::pow(extrapolated(n, i, m) - mean[i], 2);
    error[i] = std::sqrt(error[i] / (launches_ - 1.0) / launches_);
  }
  return error;
}

std::size_t WeakLevels::carriers(std::size_t n) {
  const std::vector<std::size_t>& each = trees(n).front().carriers;
  return *std::min_element(each.begin(), each.end());
}

std::uint64_t WeakLevels::ode_solves(std::size_t n) {
  std::uint64_t sum = 0;
  for (const WeakEstimate& tree : trees(n)) sum += tree.ode_solves;
  return sum;
}

}  // namespace wienertree
