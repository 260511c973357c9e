#pragma once
/// Runs a weak approximation as its options say.
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "weak_arguments.hpp"
#include "wienertree/weak/journal.hpp"

namespace wienertree::app {

/// Numbers of a row under their names.
using NamedNumbers = std::vector<std::pair<std::string, double>>;

struct WeakOutcome {
  std::vector<NamedNumbers> rows;  ///< one a payoff: value, standard_error, and what further options ask for
  std::vector<std::string> results;  ///< one a payoff, for people
  WeakRun run;
  std::size_t leaves = 0;
  std::uint64_t ode_solves = 0;
};

/// Told how many steps there will be (0: unknown) before the first, and of the end of each; may be empty.
struct WeakObserver {
  std::function<void(std::size_t)> begin;
  std::function<void()> step;
  WeakJournal* journal = nullptr;  ///< where trees are recorded; may be null
};

/// The number of steps is given. Launches start from `first_launch`.
WeakOutcome weak_with_steps(const WeakArguments& arguments, const WeakProblem& problem, DrivenFormula driven,
                            std::uint32_t first_launch, const WeakObserver& observer);
/// The error is given.
WeakOutcome weak_to_tolerance(const WeakArguments& arguments, const WeakProblem& problem,
                              const WeakObserver& observer);

}  // namespace wienertree::app
