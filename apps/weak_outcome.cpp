#include "weak_outcome.hpp"

#include <fmt/format.h>

#include <cmath>

#include "wienertree/weak/control.hpp"

namespace wienertree::app {
namespace {

// The next row, time by time.
NamedNumbers& add_row(const WeakRun& run, const WeakProblem& problem, WeakOutcome& outcome) {
  const std::size_t at = outcome.rows.size(), payoffs = problem.payoffs.size();
  outcome.payoffs.push_back(problem.payoffs[at % payoffs]);
  NamedNumbers& row = outcome.rows.emplace_back();
  if (run.horizons.size() > 1) row.push_back({"horizon", run.horizons[at / payoffs]});
  return row;
}

}  // namespace

WeakOutcome weak_with_steps(const WeakArguments& a, const WeakProblem& problem, DrivenFormula driven,
                            std::uint32_t first_launch, const WeakObserver& observer) {
  WeakOutcome outcome;
  outcome.run = weak_run(a, problem, std::move(driven.formula));
  WeakRun& run = outcome.run;
  const std::size_t trees = run.launches * (run.richardson ? std::size_t{2} : std::size_t{1});
  run.first_launch = first_launch;
  if (observer.begin) observer.begin(trees * run.steps);
  if (observer.step) run.options.observe = [&](std::size_t) { observer.step(); };
  run.options.journal = observer.journal;
  const WeakResult result = run_weak(driven.model, averaged_payoffs(a, problem, 1).front(), run);
  outcome.leaves = result.leaves;
  outcome.ode_solves = result.ode_solves;
  for (std::size_t i = 0; i < result.value.size(); ++i) {
    NamedNumbers& row = add_row(run, problem, outcome);
    std::string& text = outcome.results.emplace_back();
    row.insert(row.end(), {{"value", result.value[i]}, {"standard_error", result.standard_error[i]}});
    text = fmt::format("{:.12g}", result.value[i]);
    if (run.launches > 1) text += fmt::format(" +- {:.2g}", result.standard_error[i]);
    if (!run.richardson) continue;
    row.insert(row.end(), {{"extrapolated", result.extrapolated[i]},
                           {"extrapolated_standard_error", result.extrapolated_standard_error[i]}});
    text += fmt::format(", extrapolated {:.12g}", result.extrapolated[i]);
    if (run.launches > 1) text += fmt::format(" +- {:.2g}", result.extrapolated_standard_error[i]);
  }
  return outcome;
}

WeakOutcome weak_to_tolerance(const WeakArguments& a, const WeakProblem& problem,
                              const WeakObserver& observer) {
  WeakTarget target;
  target.tolerance = *a.tolerance;
  target.formulas = weak_formulas(a, problem);
  target.guards = weak_guards(problem);
  target.choose_nodes = !a.nodes;
  target.choose_launches = !a.launches;
  target.choose_accuracy = !a.relative_tolerance && !a.absolute_tolerance && a.flow != FlowMethod::exact;
  WeakRun run = weak_run(a, problem, target.formulas.front());
  target.choose_nodes = target.choose_nodes && !a.patch_width;
  if (run.options.patch_width > 0)
    run.options.patch_width = a.patch_width.value_or(starting_patch_width);
  else if (target.choose_nodes && !is_random(run.options))
    run.options.nodes = starting_nodes(problem, run.options.thinning.method);
  if (target.choose_accuracy) run.options.tolerance = {1e-6, 1e-8};
  if (observer.begin) observer.begin(0);
  if (observer.step) run.options.observe = [&](std::size_t) { observer.step(); };
  run.options.journal = observer.journal;
  // The narrowest of 10 rungs is 0.21 of the width.
  const ControlledResult result =
      wienertree::weak_to_tolerance(problem.source.model(), averaged_payoffs(a, problem, 10), run, target);
  WeakOutcome outcome;
  outcome.run = result.run;
  outcome.leaves = result.leaves;
  outcome.ode_solves = result.ode_solves;
  outcome.notes = result.notes;
  if (!result.reached) outcome.warning = result.limit;
  for (std::size_t i = 0; i < result.value.size(); ++i) {
    const WeakErrorSplit& e = result.error[i];
    NamedNumbers& row = add_row(run, problem, outcome);
    row.insert(row.end(), {{"value", result.value[i]},
                           {"standard_error", result.standard_error[i]},
                           {"error", e.total()},
                           {"error_discretisation", e.discretisation},
                           {"error_thinning", e.thinning},
                           {"error_ode", e.ode},
                           {"error_sampling", e.sampling}});
    outcome.results.push_back(
        fmt::format("{:.12g}, error about {:.1e} = discretisation {:.1e} + thinning {:.1e} + ODE {:.1e} + "
                    "sampling {:.1e}",
                    result.value[i], e.total(), e.discretisation, e.thinning, e.ode, e.sampling));
  }
  return outcome;
}

}  // namespace wienertree::app
