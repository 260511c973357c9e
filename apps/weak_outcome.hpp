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
  /// One a payoff, time by time: value, standard_error, and what further options ask for. With several times
  /// the first column is `horizon`.
  std::vector<NamedNumbers> rows;
  std::vector<std::string> payoffs;  ///< one a row, as given
  std::vector<std::string> results;  ///< one a row, for people
  std::vector<std::string> notes;    ///< what the control of the error found
  /// Not empty: the tolerance was not reached; what limits the accuracy and what to try.
  std::string warning;
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
