#include "wienertree/weak/control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "wienertree/cubature/verification.hpp"
#include "wienertree/tree/initial.hpp"
#include "wienertree/tree/tree_size.hpp"
#include "wienertree/weak/dynamics.hpp"
#include "wienertree/weak/levels.hpp"

namespace wienertree {
namespace {

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

double order_of(const CubatureFormula& formula) { return (formula.degree - 1) / 2.0; }

// A checkpoint that is not one of this computation is no failure of a level.
bool of_checkpoint(const Error& failure) { return failure.where() == "checkpoint"; }

// What ends a computation that has not reached its tolerance, with the reason.
struct Exhausted {
  std::string reason;
};

constexpr std::size_t enough_carriers = 8, enough_steps = 64;
constexpr double finer_width = 1.25;

class Control {
 public:
  Control(const Model& model, const std::vector<std::vector<WeakPayoff>>& rungs, WeakRun run,
          const WeakTarget& target)
      : model_(model),
        payoffs_a_rung_(rungs.front().size()),
        rungs_(rungs.size()),
        times_(std::max<std::size_t>(1, run.horizons.size())),
        run_(std::move(run)),
        target_(target),
        random_(is_random(run_.options)),
        by_width_(run_.options.patch_width > 0) {
    for (const auto& rung : rungs) payoffs_.insert(payoffs_.end(), rung.begin(), rung.end());
  }

  ControlledResult operator()() {
    // An exact transition has no trouble with bounds.
    for (const BoundTrouble& trouble :
         run_.options.transition ? std::vector<BoundTrouble>{} : bound_troubles(model_))
      if (reaches(trouble)) best_.notes.push_back(trouble.reason);
    bounds_fail_ = !best_.notes.empty();
    choose_formula();
    measure_ode_error(target_.choose_accuracy ? 4 : 0);
    run_.steps = fewest_steps();
    // One node can only be compared with two.
    fewer_nodes_ = run_.options.nodes > 1 ? std::max<std::size_t>(1, 2 * run_.options.nodes / 3) : 2;
    if (!random_) run_.launches = 1;
    if (random_ && target_.choose_launches) run_.launches = 16;
    try {
      for (;;) {
        try {
          estimate_or_shorten();
        } catch (const Error& failure) {
          if (best_.value.empty()) salvage(failure);
          throw;
        }
        keep_best();
        if (bounds_fail_ && (within() || run_.steps >= enough_steps))
          give_up(best_.notes.front() +
                  ": nothing is known of the error. Write the state in other coordinates (a square root), or "
                  "without `boundary`");
        if (!within())
          refine();
        else if (guarded())
          break;
      }
      best_.reached = true;
    } catch (const Exhausted& exhausted) {
      best_.limit = exhausted.reason;
    } catch (const Error& failure) {
      // What a finer level meets, a node that cannot be moved or a tree that is too large, takes nothing from
      // the answer of a coarser one.
      if (best_.value.empty() || of_checkpoint(failure)) throw;
      best_.limit = told(failure.what());
    }
    best_.ode_solves = solves();
    return std::move(best_);
  }

 private:
  std::size_t value_count() const { return payoffs_a_rung_ * times_; }
  // Where payoff and time k of a rung stand among the values of a tree.
  std::size_t place(std::size_t rung, std::size_t k) const {
    return (k / payoffs_a_rung_) * payoffs_a_rung_ * rungs_ + rung * payoffs_a_rung_ + k % payoffs_a_rung_;
  }

  // Whether mass arrives at the bound within 16 steps of degree 5 or so: more than a payoff of the size of the
  // tolerance would feel.
  bool reaches(const BoundTrouble& trouble) const {
    WeakRun run = run_;
    run.options.formula = target_.formulas.front();
    run.steps = steps_of_level(run_, 16);
    run.launches = 1;
    const BatchFunction held = [trouble](ConstBatchView x, std::span<double> out) {
      const double slack = 1e-9 * (1 + std::abs(trouble.at));
      for (std::size_t n = 0; n < out.size(); ++n)
        out[n] = trouble.upper ? (x(trouble.state, n) >= trouble.at - slack ? 1 : 0)
                               : (x(trouble.state, n) <= trouble.at + slack ? 1 : 0);
    };
    std::vector<WeakPayoff> payoffs = payoffs_;
    payoffs.emplace_back(held);
    try {
      const std::vector<double> value = run_weak(model_, payoffs, run).value;
      double size = 1;
      for (std::size_t i = 0; i + 1 < payoffs.size(); ++i) size = std::max(size, std::abs(value[i]));
      return value[payoffs.size() - 1] * size > target_.tolerance / 100;
    } catch (const RunError&) {
      return true;
    }
  }

  // A step of half of 1/rate. In several dimensions trees of many steps are dear: guards must do from 32 on.
  std::size_t fewest_steps() {
    const double rate = fastest_rate(model_, run_.horizon);
    const std::size_t most = model_.reported_dimension() > 1 ? 32 : 512;
    // Below a level of 8 steps, intervals between times do not all double with the level.
    const std::size_t least = times_ > 1 ? 8 : 4;
    std::size_t n = least;
    while (longest_step(n) * 2 * rate > 1 && n < most) n *= 2;
    if (n > least)
      best_.notes.push_back(
          fmt::format("at least {} steps, for the fastest rate of the model is {:.3g} per unit of time",
                      steps_of_level(run_, n), rate));
    return n;
  }

  // Of equal steps, where they shrink towards the horizon.
  double longest_step(std::size_t n) const {
    WeakOptions options;
    WeakRun run = run_;
    if (run.horizons.size() < 2) run.grid = GridKind::uniform;
    set_grid(run, interval_steps(run, n), options);
    double longest = 0;
    for (std::size_t i = 1; i < options.grid.size(); ++i)
      longest = std::max(longest, options.grid[i] - options.grid[i - 1]);
    return longest * (1 - 1e-12);
  }

  // Trees of 2 steps are grown whole where they are small, so that no thinning blurs what they show.
  WeakLevels levels_of_two_steps(WeakRun run) const {
    const std::size_t roots = first_generation(model_, run.options.nodes).size();
    if (unpruned_size(run.options.formula, model_, 2, roots).leaves <= 1e5)
      run.options.thinning.method = ThinningMethod::none;
    run.horizons.clear();
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
    return n * (static_cast<double>(total_segments(formula)) + segments_of_guard(formula));
  }

  // With several times every guard is a tree with all of their reports: its work decides as well.
  double segments_of_guard(const CubatureFormula& formula) const {
    if (times_ == 1) return 0;
    const auto [higher, lower] = guards_of(formula.degree);
    if (lower_is_cheaper(higher, lower) || higher == nullptr)
      return lower == nullptr ? 0 : 2 * static_cast<double>(total_segments(*lower));
    return static_cast<double>(total_segments(*higher));
  }
  static bool lower_is_cheaper(const CubatureFormula* higher, const CubatureFormula* lower) {
    return higher && lower && lower->degree >= 5 && 2 * total_segments(*lower) < total_segments(*higher);
  }
  // Families of the last two steps before each of several times cost more than a higher degree.
  bool families_too_dear(const CubatureFormula& formula) const {
    if (times_ == 1 || formula.degree > 5) return false;
    for (const WeakPayoff& payoff : payoffs_)
      if (!payoff.function.kinks.empty()) return true;
    return false;
  }

  struct Guards {
    const CubatureFormula *higher = nullptr, *lower = nullptr;
  };
  Guards guards_of(int degree) const {
    Guards found;
    for (const CubatureFormula& guard : target_.guards) {
      if (guard.degree < degree) found.lower = &guard;
      if (guard.degree > degree && found.higher == nullptr) found.higher = &guard;
    }
    return found;
  }

  void choose_formula() {
    const CubatureFormula* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const CubatureFormula& formula : target_.formulas) {
      if (target_.formulas.size() == 1) best = &formula;
      // One step may not cost more than the whole of what is known to do.
      if (best != nullptr && 2 * static_cast<double>(total_segments(formula)) >= least) continue;
      if (target_.formulas.size() == 1) break;
      if (families_too_dear(formula) && target_.formulas.back().degree > formula.degree) continue;
      try {
        const double work = promised_work(formula);
        if (work >= least) continue;
        least = work;
        best = &formula;
      } catch (const RunError&) {  // steps this long leave the domain
      }
    }
    // No formula can make 2 steps: the shortest paths of all, then.
    run_.options.formula = best != nullptr ? *best : target_.formulas.front();
  }

  // Makes the flow more accurate, a hundredfold each of `attempts` times at most, until 16 steps, which are
  // many for a formula that was chosen for its order, leave a tenth of the tolerance.
  void measure_ode_error(int attempts) {
    ode_.assign(payoffs_.size() * times_, 0.0);
    if (run_.options.flow == FlowMethod::exact || run_.options.transition) return;
    const double steps = static_cast<double>(std::max<std::size_t>(16, run_.steps));
    for (int attempt = 0;; ++attempt) {
      WeakRun finer = run_;
      finer.options.tolerance.relative /= 100;
      finer.options.tolerance.absolute /= 100;
      WeakLevels now = levels_of_two_steps(run_), then = levels_of_two_steps(finer);
      std::size_t n = 2;
      for (;; n *= 4) try {
          now.value(n);
          then.value(n);
          break;
        } catch (const RunError&) {
          if (n >= enough_steps) throw;
        }
      const std::vector<double> value = now.value(n), better = then.value(n);
      pilot_solves_ += now.ode_solves() + then.ode_solves();
      // That at earlier times is no larger.
      for (std::size_t i = 0; i < ode_.size(); ++i)
        ode_[i] =
            std::abs(value[i % payoffs_.size()] - better[i % payoffs_.size()]) * 2 / static_cast<double>(n);
      if (largest_difference(value, better) * steps / static_cast<double>(n) <= target_.tolerance / 10 ||
          attempt >= attempts)
        return;
      run_ = finer;
    }
  }

  WeakLevels& at(std::size_t nodes, double width) {
    auto found = levels_.find({nodes, width});
    if (found == levels_.end()) {
      WeakRun run = run_;
      run.options.nodes = nodes;
      run.options.patch_width = width;
      found = levels_.emplace(std::pair{nodes, width}, WeakLevels(model_, payoffs_, run)).first;
    }
    found->second.set_launches(run_.launches);
    found->second.set_base(run_.steps);
    return found->second;
  }
  WeakLevels& trees_now() { return at(run_.options.nodes, run_.options.patch_width); }

  // The rung that is taken.
  std::size_t rung_of(const std::vector<double>& X) const {
    for (std::size_t rung = 0; rung + 2 < rungs_; ++rung) {
      double change = 0;
      for (std::size_t k = 0; k < value_count(); ++k)
        change = std::max(change, std::abs(X[place(rung, k)] - X[place(rung + 1, k)]));
      if (change <= target_.tolerance / 4) return rung;
    }
    return rungs_ > 1 ? rungs_ - 2 : 0;
  }

  // Steps that leave the domain are halved.
  void estimate_or_shorten() {
    for (;;) try {
        return estimate();
      } catch (const RunError&) {
        if (run_.steps >= enough_steps) throw;
        run_.steps *= 2;
      }
  }

  void estimate() {
    const std::size_t n = run_.steps;
    WeakLevels& trees = trees_now();
    const std::vector<double> X = trees.extrapolated(n), X_half = trees.extrapolated(n / 2),
                              deviation = trees.standard_error(n);
    std::vector<std::vector<double>> V;
    for (std::size_t m = n; m >= 1 && V.size() < 4; m /= 2) {
      if (V.size() < 3) {
        V.push_back(trees.value(m));
        continue;
      }
      try {
        V.push_back(trees.value(m));
      } catch (const RunError&) {  // so long a step leaves the domain; three levels do
      }
    }
    const std::size_t rung = rung_ = rung_of(X);
    result_.value.assign(value_count(), 0.0);
    result_.standard_error.assign(value_count(), 0.0);
    result_.error.assign(value_count(), {});
    for (std::size_t k = 0; k < value_count(); ++k) {
      const std::size_t i = place(rung, k);
      WeakErrorSplit& error = result_.error[k];
      std::vector<double> of_payoff;
      for (const std::vector<double>& values : V) of_payoff.push_back(values[i]);
      error.discretisation = discretisation_estimate(of_payoff, run_.options.formula.degree);
      if (bounds_fail_) error.discretisation = std::max(error.discretisation, std::abs(X[i]));
      if (rungs_ > 1) error.discretisation += std::abs(X[i] - X[place(rung + 1, k)]) * 4 / 3;
      error.ode = ode_[i] * static_cast<double>(n) / 2;
      error.sampling = 2 * deviation[i];
      result_.value[k] = X[i];
      result_.standard_error[k] = deviation[i];
    }
    result_.leaves = trees.leaves(n);
    if (random_ || run_.options.thinning.method == ThinningMethod::none) return;
    WeakLevels& other = by_width_ ? at(run_.options.nodes, finer_width * run_.options.patch_width)
                                  : at(fewer_nodes_, run_.options.patch_width);
    const std::vector<double> Y = other.extrapolated(n), Y_half = other.extrapolated(n / 2);
    for (std::size_t k = 0; k < value_count(); ++k) {
      const std::size_t i = place(rung, k);
      result_.error[k].thinning = std::max(std::abs(X[i] - Y[i]), std::abs(X_half[i] - Y_half[i]));
    }
  }

  // Where even the first number of steps cannot be made: the best of what fewer steps give. Nothing is known of
  // the error of steps that are too long for the model.
  void salvage(const Error& failure) {
    if (of_checkpoint(failure)) return;
    for (std::size_t m = run_.steps / 2; m >= 1; m /= 2) try {
        WeakLevels& trees = trees_now();
        const std::vector<double> X = trees.extrapolated(m), V = trees.value(m),
                                  deviation = trees.standard_error(m);
        const std::vector<double> coarser = m > 1 ? trees.value(m / 2) : std::vector<double>(V.size(), 0.0);
        result_.value.assign(value_count(), 0.0);
        result_.standard_error = result_.value;
        result_.error.assign(value_count(), {});
        rung_ = rung_of(X);
        for (std::size_t k = 0; k < value_count(); ++k) {
          const std::size_t i = place(rung_, k);
          result_.value[k] = X[i];
          result_.standard_error[k] = deviation[i];
          result_.error[k].discretisation = std::max(std::abs(X[i]), std::abs(V[i] - coarser[i]));
          result_.error[k].sampling = 2 * deviation[i];
        }
        result_.leaves = trees.leaves(m);
        run_.steps = m;
        return keep_best();
      } catch (const Error&) {  // nor this many
      }
  }

  static double total_of(const ControlledResult& result) {
    double most = 0;
    for (const WeakErrorSplit& e : result.error) most = std::max(most, e.total());
    return most;
  }

  // What the guards added counts: a result without it is no better.
  void keep_best() {
    if (!best_.value.empty() && total_of(best_) < total_of(result_)) return;
    best_.value = result_.value;
    best_.standard_error = result_.standard_error;
    best_.error = result_.error;
    best_.leaves = result_.leaves;
    best_.run = run_;
    best_.run.richardson = run_.steps > 1;
    best_.run.steps = steps_of_level(run_, run_.steps);
  }

  bool within() const { return total_of(result_) <= target_.tolerance; }

  // Whether nothing speaks against the estimates; else what does has been made finer.
  bool guarded() {
    if (trees_now().carriers(run_.steps) < enough_carriers && run_.steps < enough_steps) {
      double_steps();
      return false;
    }
    compare_degrees();
    force_best();
    if (!within()) {
      double_steps();
      return false;
    }
    if (recombination_differs()) {
      if (!target_.choose_nodes)
        give_up("thinning is not to be trusted with so few nodes: give more --nodes");
      add_nodes();
      return false;
    }
    return true;
  }

  void force_best() {
    best_.value.clear();
    keep_best();
  }

  void compare_degrees() {
    if (target_.guards.empty()) return;
    const auto [higher, lower] = guards_of(run_.options.formula.degree);
    std::vector<std::pair<const CubatureFormula*, std::size_t>> order = {{higher, 1}, {lower, 2}};
    if (times_ > 1 && lower_is_cheaper(higher, lower)) std::swap(order[0], order[1]);
    // Trees of n and n/2 steps.
    const double once = static_cast<double>(trees_now().ode_solves(run_.steps)) /
                        static_cast<double>(total_segments(run_.options.formula));
    const auto affordable = [&](const CubatureFormula* guard, double steps) {
      return guard != nullptr && static_cast<double>(solves()) +
                                         1.5 * steps * once * static_cast<double>(total_segments(*guard)) <=
                                     target_.most_solves;
    };
    std::vector<double> Y, deviation;
    std::string obstacle = fmt::format("it would take over {:.2g} ODE solves", target_.most_solves);
    for (const auto& [guard, multiple] : order) {
      if (!Y.empty() || !affordable(guard, static_cast<double>(multiple))) continue;
      WeakRun run = run_;
      run.options.formula = *guard;
      WeakLevels levels(model_, payoffs_, run);
      levels.set_launches(run_.launches);
      levels.set_base(run_.steps);
      try {
        Y = levels.extrapolated(multiple * run_.steps);
        deviation = levels.standard_error(multiple * run_.steps);
      } catch (const Error& failure) {
        if (of_checkpoint(failure)) throw;
        obstacle = failure.what();
      }
      pilot_solves_ += levels.ode_solves();
    }
    if (Y.empty()) give_up("no comparison with another degree: " + obstacle);
    for (std::size_t k = 0; k < value_count(); ++k) {
      double& error = result_.error[k].discretisation;
      const std::size_t i = place(rung_, k);
      // Two standard errors of the difference are no sign of anything.
      const double noise = 2 * std::hypot(result_.standard_error[k], deviation[i]);
      // The other value may be off by a quarter of the difference, on the far side.
      error = std::max(error, (std::abs(result_.value[k] - Y[i]) - noise) * 4 / 3);
    }
  }

  bool recombination_differs() {
    const std::size_t d = model_.reported_dimension() - (run_.options.discount_state ? 1 : 0);
    ThinningOptions& thinning = run_.options.thinning;
    if (thinning.method != ThinningMethod::recombination || d < 2 || thinning.own) return false;
    WeakRun run = run_;
    const int usual = thinning.recombination_degree > 0 ? thinning.recombination_degree : d == 2 ? 5 : 3;
    run.options.thinning.recombination_degree = usual > 3 ? 3 : 2;
    WeakLevels levels(model_, payoffs_, run);
    levels.set_base(run_.steps);
    const std::vector<double> Y = levels.value(run_.steps), V = trees_now().value(run_.steps);
    pilot_solves_ += levels.ode_solves();
    double most = 0;
    for (std::size_t k = 0; k < value_count(); ++k)
      most = std::max(most, std::abs(V[place(rung_, k)] - Y[place(rung_, k)]));
    return most > target_.tolerance;
  }

  static double largest(const ControlledResult& result, double WeakErrorSplit::*part) {
    double most = 0;
    for (const WeakErrorSplit& e : result.error) most = std::max(most, e.*part);
    return most;
  }

  void refine() {
    const double steps = largest(result_, &WeakErrorSplit::discretisation),
                 thinning = largest(result_, &WeakErrorSplit::thinning),
                 ode = largest(result_, &WeakErrorSplit::ode),
                 sampling = largest(result_, &WeakErrorSplit::sampling), e = target_.tolerance;
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
    if (thinning > e && !target_.choose_nodes)
      give_up("that of thinning needs more --nodes or a smaller --patch-width");
    // Noise may make up 4 of its own size of what the steps seem to leave.
    if (random_ && sampling >= steps / 4) return sample_more(sampling);
    // The same for thinning.
    if (thinning > steps / 2 && target_.choose_nodes) return add_nodes();
    double_steps();
  }

  void double_steps() {
    if (run_.options.thinning.method == ThinningMethod::none)
      refuse_whole_tree(steps_of_level(run_, 2 * run_.steps));
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
    if (by_width_) {
      if (run_.options.patch_width < 0.05) give_up("narrower patches do not help");
      run_.options.patch_width /= finer_width;
      return;
    }
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
    const auto finest = static_cast<double>(trees_now().ode_solves(run_.steps));
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

  std::string told(const std::string& reason) const {
    return fmt::format(
        "not reached by degree {} in {} steps: errors of about {:.1e} by the steps, {:.1e} by "
        "thinning, {:.1e} by sampling, {:.1e} by the ODEs; {}",
        best_.run.options.formula.degree, best_.run.steps, largest(best_, &WeakErrorSplit::discretisation),
        largest(best_, &WeakErrorSplit::thinning), largest(best_, &WeakErrorSplit::sampling),
        largest(best_, &WeakErrorSplit::ode), reason);
  }
  [[noreturn]] void give_up(const std::string& reason) const { throw Exhausted{told(reason)}; }

  const Model& model_;
  std::size_t payoffs_a_rung_, rungs_, times_;
  std::vector<WeakPayoff> payoffs_;  ///< rung by rung
  WeakRun run_;                      ///< steps is the level of the grid
  const WeakTarget& target_;
  bool random_, by_width_, bounds_fail_ = false, ode_tightened_ = false;
  ControlledResult result_, best_;  ///< of the trees now; what is returned
  std::size_t rung_ = 0;
  std::vector<double> ode_;  ///< at 2 steps, one for each value of a tree
  std::uint64_t pilot_solves_ = 0;
  std::size_t fewer_nodes_ = 1;
  std::map<std::pair<std::size_t, double>, WeakLevels> levels_;  ///< by number of nodes and patch width
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

ControlledResult weak_to_tolerance(const Model& model, const std::vector<std::vector<WeakPayoff>>& rungs,
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
