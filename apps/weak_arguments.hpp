#pragma once
/// The options of `weak`, and the problem and the run they stand for.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "table.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/weak/run.hpp"
#include "wienertree/weak/smoothing.hpp"

namespace wienertree::app {

/// How kinks and jumps of a payoff are averaged.
enum class KinkTreatment {
  automatic,  ///< last_step where that smooths them (weak/smoothing.hpp), else kernel
  last_step,  ///< by the law of the last step
  kernel,     ///< smoothed over --kink-width standard deviations of their arguments
  sharp,      ///< as they are
};

/// What was given on the command line; nothing else.
struct WeakArguments {
  std::string model;
  Assignments parameters;
  std::vector<std::string> payoffs, averages, integrals;
  std::optional<std::string> discount, formula;
  std::optional<std::string>
      inputs;                    ///< the file of the model's functions of time; of the command weak alone
  std::vector<double> horizons;  ///< ascending
  std::optional<double> gamma, patch_width, relative_tolerance, absolute_tolerance, tolerance, kink_width;
  std::optional<std::uint64_t> steps, degree, nodes, seed, launches, threads, recombination_degree;
  std::optional<GridKind> grid;
  std::optional<ThinningMethod> thin;
  std::optional<SiteOrder> order;
  std::optional<FlowMethod> flow;
  std::optional<KinkTreatment> kinks;
  std::optional<bool> square_roots;  ///< by their exact transition
  bool richardson = false;

  double horizon() const { return horizons.back(); }
};

void add_weak_options(CLI::App& app, WeakArguments& arguments);

/// A model and what is to be averaged at its horizon.
struct WeakProblem {
  TextModel source;                            ///< the model with its added states
  std::vector<std::string> added;              ///< names of these
  std::vector<std::string> payoffs;            ///< as given
  std::vector<KinkedFunction> kinked;          ///< one a payoff
  std::vector<KinkTreatment> treatment;        ///< one a payoff; sharp where there are no kinks
  std::vector<std::vector<KinkScale>> scales;  ///< of the kinks of payoffs that a kernel smooths
  /// By payoff and time where a price is integrated out, whose law given the variances depends on the time; else empty.
  std::vector<std::vector<BatchFunction>> by_time;
  double discount_rate = 0;                          ///< where it is constant
  std::optional<std::size_t> discount_state;         ///< where it is not
  std::shared_ptr<const TransitionRule> transition;  ///< null: the paths of a formula
};

/// @throws InputError naming the option, with the column in an expression
WeakProblem weak_problem(const WeakArguments& arguments);
/// Of a model that is at hand, whatever `arguments.model` says.
WeakProblem weak_problem(const WeakArguments& arguments, const TextModel& model);

/// The payoffs as they are averaged, several times: kinks that a kernel smooths over --kink-width at first and
/// over 2^{1/4} less from rung to rung. One rung if there are none.
std::vector<std::vector<WeakPayoff>> averaged_payoffs(const WeakArguments& arguments,
                                                      const WeakProblem& problem, std::size_t rungs);

/// A formula with the model whose fields drive it.
struct DrivenFormula {
  CubatureFormula formula;
  Model model;  ///< has brackets as further fields for a formula of Lie polynomials
};
DrivenFormula weak_formula(const WeakArguments& arguments, const WeakProblem& problem);

/// The formulas that --tolerance chooses from: the one that is given, or the best of each degree above 3.
/// @throws InputError if one of Lie polynomials is given
std::vector<CubatureFormula> weak_formulas(const WeakArguments& arguments, const WeakProblem& problem);

/// One a degree, from 3 on, to compare with.
std::vector<CubatureFormula> weak_guards(const WeakProblem& problem);

/// Fills in the defaults. @throws InputError for an option that does not apply to another one
WeakRun weak_run(const WeakArguments& arguments, const WeakProblem& problem, CubatureFormula formula);

/// The width of patches, or the nodes, with which --tolerance begins.
inline constexpr double starting_patch_width = 2;
std::size_t starting_nodes(const WeakProblem& problem, ThinningMethod thin);

/// Names and values of all options in force.
Json options_in_force(const WeakRun& run);
/// And those of the payoffs' kinks.
void note_kinks(const WeakArguments& arguments, const WeakProblem& problem, Json& options);

}  // namespace wienertree::app
