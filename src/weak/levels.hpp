#pragma once
/// The trees that a weak approximation to a tolerance compares.
#include <cstdint>
#include <map>
#include <vector>

#include "wienertree/tree/generation.hpp"
#include "wienertree/weak/run.hpp"

namespace wienertree {

/// Trees of one formula, number of nodes and accuracy of the flow, by number of steps and launch. Each is
/// grown when it is first asked for, once.
class WeakLevels {
 public:
  /// @param run its steps, launches and richardson have no meaning
  WeakLevels(const Model& model, const std::vector<WeakPayoff>& payoffs, WeakRun run);

  /// Averages are over the launches 0..M-1 from now on.   @pre M >= 1
  void set_launches(std::uint32_t M) { launches_ = M; }

  /// Level `base` is that of interval_steps(); the others halve or double its steps in every interval, so that
  /// extrapolation finds each of them halved. 0: each level is its own.
  void set_base(std::size_t base) { base_ = base; }

  /// V_n, one a payoff.
  std::vector<double> value(std::size_t n);
  /// X_n, extrapolated from n/2 and n steps (run_weak); X_1 = V_1.   @pre n is a power of 2
  std::vector<double> extrapolated(std::size_t n);
  /// Of X_n, from the launches; 0 where there is one.
  std::vector<double> standard_error(std::size_t n);

  /// The fewest leaves or families that carry a payoff with n steps.
  std::size_t carriers(std::size_t n);
  std::size_t leaves(std::size_t n) { return trees(n).back().leaves; }
  /// Of all launches with n steps.
  std::uint64_t ode_solves(std::size_t n);
  /// Of all trees that were grown.
  std::uint64_t ode_solves() const { return solves_; }

 private:
  const std::vector<WeakEstimate>& trees(std::size_t n);
  std::vector<std::size_t> counts_of(std::size_t n) const;
  double extrapolated(std::size_t n, std::size_t payoff, std::size_t launch);

  const Model& model_;
  const std::vector<WeakPayoff>& payoffs_;
  WeakRun run_;
  Generation start_;
  std::uint32_t launches_ = 1;
  std::uint64_t solves_ = 0;
  std::size_t base_ = 0;
  /// By steps in each interval, then launch.
  std::map<std::vector<std::size_t>, std::vector<WeakEstimate>> trees_;
};

}  // namespace wienertree
