#include "wienertree/weak/control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "wienertree/cubature/verification.hpp"
#include "wienertree/tree/initial.hpp"
#include "wienertree/tree/tree_size.hpp"
#include "wienertree/weak/levels.hpp"

namespace wienertree {
namespace {

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

double order_of(const CubatureFormula& formula) { return (formula.degree - 1) / 2.0; }

class Control {
 public:
  Control(const Model& model, const std::vector<std::vector<BatchFunction>>& rungs, WeakRun run,
          const WeakTarget& target)
      : model_(model),
        count_(rungs.front().size()),
        rungs_(rungs.size()),
        run_(std::move(run)),
        target_(target),
        random_(is_random(run_.options)) {
    for (const auto& rung : rungs) payoffs_.insert(payoffs_.end(), rung.begin(), rung.end());
  }

  ControlledResult operator()() {
    choose_formula();
    measure_ode_error(target_.choose_accuracy ? 4 : 0);
    run_.steps = 4;
    // One node can only be compared with two.
    fewer_nodes_ = run_.options.nodes > 1 ? std::max<std::size_t>(1, 2 * run_.options.nodes / 3) : 2;
    if (!random_) run_.launches = 1;
    if (random_ && target_.choose_launches) run_.launches = 16;
    for (estimate(); !within(); estimate()) refine();
    return finish();
  }

 private:
  // Trees of 2 steps are grown whole where they are small, so that no thinning blurs what they show.
  WeakLevels levels_of_two_steps(WeakRun run) const {
    const std::size_t roots = first_generation(model_, run.options.nodes).size();
    if (unpruned_size(run.options.formula, model_, 2, roots).leaves <= 1e5)
      run.options.thinning.method = ThinningMethod::none;
    return {model_, payoffs_, std::move(run)};
  }

  // Work to reach the tolerance if the error of 2 steps, |V_2 - V_1| / (2^q - 1), falls as n^{-(q+1)} once
  // extrapolated.
  double promised_work(const CubatureFormula& formula) {
    WeakRun run = run_;
    run.options.formula = formula;
    WeakLevels trees = levels_of_two_steps(run);
    const double q = order_of(formula);
    const double error = largest_difference(trees.value(2), trees.value(1)) / (std::exp2(q) - 1);
    pilot_solves_ += trees.ode_solves();
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

  // Makes the flow more accurate, a hundredfold each of `attempts` times at most, until 16 steps, which are
  // many for a formula that was chosen for its order, leave a tenth of the tolerance.
  void measure_ode_error(int attempts) {
    ode_.assign(payoffs_.size(), 0.0);
    if (run_.options.flow == FlowMethod::exact) return;
    const double steps = static_cast<double>(std::max<std::size_t>(16, run_.steps));
    for (int attempt = 0;; ++attempt) {
      WeakRun finer = run_;
      finer.options.tolerance.relative /= 100;
      finer.options.tolerance.absolute /= 100;
      WeakLevels now = levels_of_two_steps(run_), then = levels_of_two_steps(finer);
      const std::vector<double> value = now.value(2), better = then.value(2);
      pilot_solves_ += now.ode_solves() + then.ode_solves();
      for (std::size_t i = 0; i < ode_.size(); ++i) ode_[i] = std::abs(value[i] - better[i]);
      if (largest_difference(value, better) * steps / 2 <= target_.tolerance / 10 || attempt >= attempts)
        return;
      run_ = finer;
    }
  }

  WeakLevels& at_nodes(std::size_t nodes) {
    auto found = levels_.find(nodes);
    if (found == levels_.end()) {
      WeakRun run = run_;
      run.options.nodes = nodes;
      found = levels_.emplace(nodes, WeakLevels(model_, payoffs_, run)).first;
    }
    found->second.set_launches(run_.launches);
    return found->second;
  }

  // The first payoff of the rung that is taken.
  std::size_t first_of_rung(const std::vector<double>& X) const {
    for (std::size_t rung = 0; rung + 2 < rungs_; ++rung) {
      double change = 0;
      for (std::size_t i = rung * count_; i < (rung + 1) * count_; ++i)
        change = std::max(change, std::abs(X[i] - X[i + count_]));
      if (change <= target_.tolerance / 4) return rung * count_;
    }
    return rungs_ > 1 ? (rungs_ - 2) * count_ : 0;
  }

  void estimate() {
    const std::size_t n = run_.steps, N = run_.options.nodes;
    WeakLevels& trees = at_nodes(N);
    const std::vector<double> X = trees.extrapolated(n), X_half = trees.extrapolated(n / 2),
                              deviation = trees.standard_error(n);
    std::vector<std::vector<double>> V;
    for (std::size_t m = n; m >= 1 && V.size() < 4; m /= 2) V.push_back(trees.value(m));
    const std::size_t first = first_of_rung(X);
    result_.value.assign(count_, 0.0);
    result_.standard_error.assign(count_, 0.0);
    result_.error.assign(count_, {});
    for (std::size_t k = 0; k < count_; ++k) {
      const std::size_t i = first + k;
      WeakErrorSplit& error = result_.error[k];
      std::vector<double> of_payoff;
      for (const std::vector<double>& values : V) of_payoff.push_back(values[i]);
      error.discretisation = discretisation_estimate(of_payoff, run_.options.formula.degree);
      if (rungs_ > 1) error.discretisation += std::abs(X[i] - X[i + count_]) * 4 / 3;
      error.ode = ode_[i] * static_cast<double>(n) / 2;
      error.sampling = 2 * deviation[i];
      result_.value[k] = X[i];
      result_.standard_error[k] = deviation[i];
    }
    result_.leaves = trees.leaves(n);
    if (random_ || run_.options.thinning.method == ThinningMethod::none) return;
    WeakLevels& other = at_nodes(fewer_nodes_);
    const std::vector<double> Y = other.extrapolated(n), Y_half = other.extrapolated(n / 2);
    for (std::size_t k = 0; k < count_; ++k) {
      const std::size_t i = first + k;
      result_.error[k].thinning = std::max(std::abs(X[i] - Y[i]), std::abs(X_half[i] - Y_half[i]));
    }
  }

  bool within() const {
    return std::all_of(result_.error.begin(), result_.error.end(),
                       [&](const WeakErrorSplit& e) { return e.total() <= target_.tolerance; });
  }

  double largest(double WeakErrorSplit::*part) const {
    double most = 0;
    for (const WeakErrorSplit& e : result_.error) most = std::max(most, e.*part);
    return most;
  }

  void refine() {
    const double steps = largest(&WeakErrorSplit::discretisation),
                 thinning = largest(&WeakErrorSplit::thinning), ode = largest(&WeakErrorSplit::ode),
                 sampling = largest(&WeakErrorSplit::sampling), e = target_.tolerance;
    double size = 0;
    for (const double value : result_.value) size = std::max(size, std::abs(value));
    if (e < 1e-14 * size) give_up(fmt::format("rounding alone leaves about {:.0e}", 1e-15 * size));
    if (ode > e / 2 && target_.choose_accuracy && !ode_tightened_) {
      // More steps than were foreseen.
      pilot_solves_ = solves();
      levels_.clear();
      measure_ode_error(2);
      ode_tightened_ = true;
      return;
    }
    if (ode > e) give_up("that of the ODEs grows with the steps: take a smaller --rtol and --atol");
    if (thinning > e && !target_.choose_nodes) give_up("that of thinning needs more --nodes");
    // Noise may make up 4 of its own size of what the steps seem to leave.
    if (random_ && sampling >= steps / 4) return sample_more(sampling);
    // The same for thinning.
    if (thinning > steps / 2 && target_.choose_nodes) return add_nodes();
    if (run_.options.thinning.method == ThinningMethod::none) refuse_whole_tree(2 * run_.steps);
    allow(2);
    run_.steps *= 2;
  }

  void sample_more(double sampling) {
    if (target_.choose_launches) {
      const double factor = std::clamp(std::ceil(std::pow(2 * sampling / target_.tolerance, 2)), 2.0, 16.0);
      allow(factor * 7 / 4);
      run_.launches *= static_cast<std::uint32_t>(factor);
      return;
    }
    if (!target_.choose_nodes) give_up("that of sampling needs more --nodes or --launches");
    add_nodes();
  }

  // By half; the trees there are become those to compare with.
  void add_nodes() {
    allow(1.5 * 7 / 4);  // trees of n, n/2 and n/4 steps
    fewer_nodes_ = run_.options.nodes;
    run_.options.nodes += std::max<std::size_t>(1, run_.options.nodes / 2);
  }

  std::uint64_t solves() const {
    std::uint64_t sum = pilot_solves_;
    for (const auto& [nodes, trees] : levels_) sum += trees.ode_solves();
    return sum;
  }

  // Before work of `factor` times the largest tree, all launches of it.
  void allow(double factor) {
    const auto finest = static_cast<double>(at_nodes(run_.options.nodes).ode_solves(run_.steps));
    if (static_cast<double>(solves()) + factor * finest > target_.most_solves)
      give_up(fmt::format("more would take over {:.2g} ODE solves", target_.most_solves));
  }

  void refuse_whole_tree(std::size_t steps) const {
    const std::size_t roots = first_generation(model_, run_.options.nodes).size();
    const UnprunedSize size = unpruned_size(run_.options.formula, model_, steps, roots);
    if (size.bytes <= run_.options.memory_limit) return;
    give_up(
        fmt::format("a whole tree of {} steps has {:.3g} leaves and needs about {:.3g} GB, over the "
                    "limit of {:.3g} GB: thin it (--thin recombination)",
                    steps, size.leaves, size.bytes / 1e9, run_.options.memory_limit / 1e9));
  }

  [[noreturn]] void give_up(const std::string& reason) const {
    throw RunError(
        fmt::format("not reached by degree {} in {} steps: errors of about {:.1e} by the steps, {:.1e} by "
                    "thinning, {:.1e} by sampling, {:.1e} by the ODEs; {}",
                    run_.options.formula.degree, run_.steps, largest(&WeakErrorSplit::discretisation),
                    largest(&WeakErrorSplit::thinning), largest(&WeakErrorSplit::sampling),
                    largest(&WeakErrorSplit::ode), reason),
        "tolerance", fmt::format("{}", target_.tolerance));
  }

  ControlledResult finish() {
    run_.richardson = true;
    result_.run = run_;
    result_.ode_solves = solves();
    return std::move(result_);
  }

  const Model& model_;
  std::size_t count_, rungs_;
  std::vector<BatchFunction> payoffs_;  ///< rung by rung
  WeakRun run_;
  const WeakTarget& target_;
  bool random_, ode_tightened_ = false;
  ControlledResult result_;
  std::vector<double> ode_;  ///< at 2 steps, one for each of payoffs_
  std::uint64_t pilot_solves_ = 0;
  std::size_t fewer_nodes_ = 1;
  std::map<std::size_t, WeakLevels> levels_;  ///< by number of nodes
};

}  // namespace

double discretisation_estimate(std::span<const double> V, int degree) {
  const double gain = std::exp2((degree - 1) / 2.0);
  const auto X = [&](std::size_t k) {
    return k + 1 < V.size() ? V[k] + (V[k] - V[k + 1]) / (gain - 1) : V[k];
  };
  const double step = std::abs(V[0] - V[1]);
  const double rho = step > 0 ? std::max(1.25, std::abs(V[1] - V[2]) / step) : gain;
  return std::max({std::abs(X(0) - X(1)), std::abs(X(1) - X(2)) / (4 * gain),
                   step * std::abs(1 / (rho - 1) - 1 / (gain - 1))});
}

ControlledResult weak_to_tolerance(const Model& model, const std::vector<std::vector<BatchFunction>>& rungs,
                                   const WeakRun& run, const WeakTarget& target) {
  if (!(target.tolerance > 0) || !std::isfinite(target.tolerance))
    throw InputError("must be positive", "tolerance", fmt::format("{}", target.tolerance));
  if (target.formulas.empty()) throw InputError("needs a formula", "tolerance");
  if (rungs.empty() || rungs.front().empty()) throw InputError("needs a payoff", "tolerance");
  if (is_random(run.options) && !target.choose_launches && run.launches < 2)
    throw InputError("one launch does not show the error of sampling: 2 or more", "launches",
                     std::to_string(run.launches));
  return Control(model, rungs, run, target)();
}

}  // namespace wienertree
