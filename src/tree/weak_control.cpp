#include "wienertree/tree/weak_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/verification.hpp"
#include "wienertree/tree/initial.hpp"

namespace wienertree {
namespace {

BatchFunction square_of(const BatchFunction& f) {
  return [f](ConstBatchView x, std::span<double> out) {
    f(x, out);
    for (double& value : out) value *= value;
  };
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

// Values by number of steps, of one formula, number of nodes and tolerance of the flow.
class Levels {
 public:
  Levels(const Model& model, const std::vector<BatchFunction>& payoffs, WeakRun run, std::uint64_t& solves)
      : model_(model),
        payoffs_(payoffs),
        run_(std::move(run)),
        start_(first_generation(model, run_.options.nodes)),
        solves_(solves) {}

  const WeakEstimate& tree(std::size_t n) {
    if (const auto found = trees_.find(n); found != trees_.end()) return found->second;
    WeakOptions options = run_.options;
    options.grid = time_grid(run_.grid, run_.horizon, n, run_.gamma);
    const WeakEstimate& estimate =
        trees_.emplace(n, weak_approximation(model_, start_, payoffs_, options)).first->second;
    solves_ += estimate.ode_solves;
    return estimate;
  }
  /// X_n. @pre n even
  std::vector<double> extrapolated(std::size_t n) {
    std::vector<double> X = tree(n).value;
    const std::vector<double>& coarse = tree(n / 2).value;
    for (std::size_t i = 0; i < X.size(); ++i)
      X[i] = extrapolate(coarse[i], X[i], n / 2, n, run_.options.formula.degree);
    return X;
  }
  const WeakRun& run() const { return run_; }

 private:
  const Model& model_;
  const std::vector<BatchFunction>& payoffs_;
  WeakRun run_;
  Generation start_;
  std::uint64_t& solves_;
  std::map<std::size_t, WeakEstimate> trees_;
};

double order_of(const CubatureFormula& formula) { return (formula.degree - 1) / 2.0; }

class Control {
 public:
  Control(const Model& model, const std::vector<BatchFunction>& payoffs, std::size_t exact, WeakRun run,
          const WeakTarget& target)
      : model_(model), payoffs_(payoffs), count_(exact), run_(std::move(run)), target_(target) {}

  ControlledResult operator()() {
    choose_formula();
    if (target_.choose_accuracy) choose_accuracy();
    ode_.resize(payoffs_.size(), 0.0);
    while (!estimate(n_, run_.options.nodes)) {
      if (largest(discretisation_) >= largest(thinning_) || !target_.choose_nodes)
        n_ *= 2;
      else
        run_.options.nodes *= 2;
      give_up_if_too_much();
    }
    return finish();
  }

 private:
  Levels levels(const WeakRun& run) { return {model_, payoffs_, run, result_.ode_solves}; }

  static double largest(const std::vector<double>& errors) {
    return *std::max_element(errors.begin(), errors.end());
  }

  // Before a doubling that would cost more than is allowed.
  void give_up_if_too_much() const {
    const auto next = static_cast<double>(n_ * run_.options.nodes * total_segments(run_.options.formula));
    if (static_cast<double>(result_.ode_solves) + next <= target_.most_solves) return;
    throw RunError(fmt::format("not reached within {:.2g} ODE solves: of degree {}, what there is leaves "
                               "errors of about {:.1e} by the steps, {:.1e} by thinning, {:.1e} by the ODEs",
                               target_.most_solves, run_.options.formula.degree, largest(discretisation_),
                               largest(thinning_), largest(ode_) * static_cast<double>(n_) / 2),
                   "tolerance", fmt::format("{}", target_.tolerance));
  }

  // Work to reach the tolerance if the error of 2 steps, |V_2 - V_1| / (2^q - 1), falls as n^{-(q+1)} once
  // extrapolated.
  double promised_work(const CubatureFormula& formula) {
    WeakRun run = run_;
    run.options.formula = formula;
    Levels trees = levels(run);
    const double q = order_of(formula);
    const double error = largest_difference(trees.tree(2).value, trees.tree(1).value) / (std::exp2(q) - 1);
    const double n = 2 * std::max(1.0, std::pow(error / target_.tolerance, 1 / (q + 1)));
    return n * static_cast<double>(total_segments(formula));
  }

  void choose_formula() {
    const CubatureFormula* best = &target_.formulas.front();
    double least = target_.formulas.size() > 1 ? promised_work(*best) : 0;
    for (std::size_t i = 1; i < target_.formulas.size(); ++i) {
      // One step may not cost more than the whole of what is known to do.
      const auto least_possible = 2 * static_cast<double>(total_segments(target_.formulas[i]));
      if (least_possible >= least) continue;
      const double work = promised_work(target_.formulas[i]);
      if (work >= least) continue;
      least = work;
      best = &target_.formulas[i];
    }
    run_.options.formula = *best;
  }

  void choose_accuracy() {
    for (int attempt = 0; attempt < 4; ++attempt) {
      WeakRun finer = run_;
      finer.options.tolerance.relative /= 100;
      finer.options.tolerance.absolute /= 100;
      Levels now = levels(run_), then = levels(finer);
      ode_ = now.tree(2).value;
      const std::vector<double>& better = then.tree(2).value;
      for (std::size_t i = 0; i < ode_.size(); ++i) ode_[i] = std::abs(ode_[i] - better[i]);
      // 16 steps are many for a formula that was chosen for its order.
      if (largest(ode_) * 8 <= target_.tolerance / 10) return;
      run_ = finer;
    }
  }

  Levels& at_nodes(std::size_t nodes) {
    if (const auto found = levels_.find(nodes); found != levels_.end()) return found->second;
    WeakRun run = run_;
    run.options.nodes = nodes;
    return levels_.emplace(nodes, levels(run)).first->second;
  }

  // The estimates at n steps and N nodes; whether they are within the tolerance for every payoff.
  bool estimate(std::size_t n, std::size_t nodes) {
    Levels& trees = at_nodes(nodes);
    value_ = trees.extrapolated(n);
    const std::vector<double> coarse = trees.extrapolated(n / 2);
    const std::vector<double>&fine = trees.tree(n).value, &half = trees.tree(n / 2).value,
          &quarter = trees.tree(n / 4).value;
    const double expected = std::exp2(order_of(run_.options.formula));
    discretisation_.resize(value_.size());
    for (std::size_t i = 0; i < value_.size(); ++i) {
      const double ratio = std::abs(half[i] - quarter[i]) / std::abs(fine[i] - half[i]);
      const double seen = ratio > 1 ? std::min(ratio, expected) : 1;  // also if it is 0/0
      discretisation_[i] = std::abs(value_[i] - coarse[i]) / (2 * seen - 1);
    }
    result_.leaves = trees.tree(n).leaves;
    thinning_.assign(value_.size(), 0.0);
    if (run_.options.thinning.method != ThinningMethod::none) {
      const std::vector<double> fewer = at_nodes(std::max<std::size_t>(1, nodes / 2)).extrapolated(n / 2);
      for (std::size_t i = 0; i < value_.size(); ++i) thinning_[i] = std::abs(coarse[i] - fewer[i]);
    }
    for (std::size_t i = 0; i < count_; ++i)
      if (!(discretisation_[i] + thinning_[i] + ode_[i] * static_cast<double>(n) / 2 <= target_.tolerance))
        return false;
    return true;
  }

  ControlledResult finish() {
    run_.steps = n_;
    run_.richardson = true;
    result_.run = run_;
    for (std::size_t i = 0; i < count_; ++i) {
      WeakErrorSplit& error = result_.error.emplace_back();
      result_.value.push_back(value_[i]);
      error.discretisation = discretisation_[i];
      if (value_.size() > count_) error.discretisation += std::abs(value_[i] - value_[count_ + i]);
      error.thinning = thinning_[i];
      error.ode = ode_[i] * static_cast<double>(n_) / 2;
    }
    return std::move(result_);
  }

  const Model& model_;
  const std::vector<BatchFunction>& payoffs_;
  std::size_t count_;
  WeakRun run_;
  const WeakTarget& target_;
  ControlledResult result_;
  std::vector<double> value_, discretisation_, thinning_, ode_;
  std::size_t n_ = 4;
  std::map<std::size_t, Levels> levels_;  // by number of nodes
};

}  // namespace

std::vector<BatchFunction> smooth_payoffs(const Model& model, const std::vector<KinkedFunction>& payoffs,
                                          double horizon, std::optional<std::size_t> discount_state,
                                          double width) {
  std::vector<BatchFunction> arguments = {
      [](ConstBatchView, std::span<double> out) { std::fill(out.begin(), out.end(), 1.0); }};
  for (const KinkedFunction& payoff : payoffs)
    for (const BatchFunction& kink : payoff.kinks) arguments.insert(arguments.end(), {kink, square_of(kink)});
  std::vector<BatchFunction> result;
  if (arguments.size() == 1 || width == 0) {
    for (const KinkedFunction& payoff : payoffs) result.push_back(payoff.exact);
    return result;
  }
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
  for (const KinkedFunction& payoff : payoffs) {
    std::vector<double> widths;
    for (std::size_t k = 0; k < payoff.kinks.size(); ++k, at += 2) {
      const double mean = moments[at] / mass, square = moments[at + 1] / mass;
      const double variance = square - mean * mean;
      // A kink whose argument does not vary lies to one side of it, or at its only value: it stays sharp.
      const bool varies = variance > 1e-12 * square;
      widths.push_back(width * (varies ? std::sqrt(variance) : 1e-6 * (std::abs(mean) + 1e-6)));
    }
    result.push_back(payoff.kinks.empty() ? payoff.exact : payoff.smoothed(widths));
  }
  return result;
}

ControlledResult weak_to_tolerance(const Model& model, const PayoffsByWidth& payoffs, const WeakRun& run,
                                   const WeakTarget& target) {
  if (!(target.tolerance > 0) || !std::isfinite(target.tolerance))
    throw InputError("must be positive", "tolerance", fmt::format("{}", target.tolerance));
  if (target.formulas.empty()) throw InputError("needs a formula", "tolerance");
  if (is_random(run.options))
    throw InputError("needs a thinning that draws nothing: recombination or none", "tolerance");
  WeakRun pilot = run;
  pilot.options.formula = target.formulas.front();
  pilot.steps = 4;
  // Kinks smoothed over 2^{1/4} less show what smoothing does: its error falls by 2^3, while the coarseness
  // of the tree shows hardly more.
  double narrower = 1;
  for (int attempt = 0;; ++attempt, narrower *= 1.25) {
    std::vector<BatchFunction> all = payoffs(narrower);
    const std::size_t count = all.size();
    const std::vector<BatchFunction> smoother = payoffs(narrower * std::pow(2.0, 0.25));
    all.insert(all.end(), smoother.begin(), smoother.end());
    const std::vector<double> value = run_weak(model, all, pilot).value;
    double smoothing = 0;
    for (std::size_t i = 0; i < count; ++i)
      smoothing = std::max(smoothing, std::abs(value[i] - value[count + i]));
    // After 8 attempts a sixth of the width: what is seen then is the tree's own coarseness.
    if (smoothing <= target.tolerance / 4 || attempt == 8) return Control(model, all, count, run, target)();
  }
}

}  // namespace wienertree
