#pragma once
/// The options of `weak`, and the problem and the run they stand for.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "table.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/weak/run.hpp"

namespace wienertree::app {

/// What was given on the command line; nothing else.
struct WeakArguments {
  std::string model;
  Assignments parameters;
  std::vector<std::string> payoffs, averages, integrals;
  std::optional<std::string> discount, formula;
  std::optional<double> horizon, gamma, relative_tolerance, absolute_tolerance, tolerance, kink_width;
  std::optional<std::uint64_t> steps, degree, nodes, seed, launches, threads, recombination_degree;
  std::optional<GridKind> grid;
  std::optional<ThinningMethod> thin;
  std::optional<SiteOrder> order;
  std::optional<FlowMethod> flow;
  bool richardson = false;
};

void add_weak_options(CLI::App& app, WeakArguments& arguments);

/// A model and what is to be averaged at its horizon.
struct WeakProblem {
  TextModel source;                           ///< the model with its added states
  std::vector<std::string> added;             ///< names of these
  std::vector<std::string> payoffs;           ///< as given
  std::vector<KinkedFunction> kinked;         ///< one a payoff
  double discount_rate = 0;                   ///< where it is constant
  std::optional<std::size_t> discount_state;  ///< where it is not
};

/// @throws InputError naming the option, with the column in an expression
WeakProblem weak_problem(const WeakArguments& arguments);
/// Of a model that is at hand, whatever `arguments.model` says.
WeakProblem weak_problem(const WeakArguments& arguments, const TextModel& model);

/// The payoffs as they are averaged, several times: kinks smoothed over --kink-width at first and over
/// 2^{1/4} less from rung to rung. One rung if there is nothing to smooth.
std::vector<std::vector<BatchFunction>> averaged_payoffs(const WeakArguments& arguments,
                                                         const WeakProblem& problem, std::size_t rungs);
/// Standard deviations over which kinks are smoothed; 0 if there are none.
double kink_width(const WeakArguments& arguments, const WeakProblem& problem);

/// A formula with the model whose fields drive it.
struct DrivenFormula {
  CubatureFormula formula;
  Model model;  ///< has brackets as further fields for a formula of Lie polynomials
};
DrivenFormula weak_formula(const WeakArguments& arguments, const WeakProblem& problem);

/// The formulas that --tolerance chooses from: the one that is given, or the best of each degree above 3.
/// @throws InputError if one of Lie polynomials is given
std::vector<CubatureFormula> weak_formulas(const WeakArguments& arguments, const WeakProblem& problem);

/// Fills in the defaults. @throws InputError for an option that does not apply to another one
WeakRun weak_run(const WeakArguments& arguments, const WeakProblem& problem, CubatureFormula formula);

/// The nodes with which --tolerance begins.
std::size_t starting_nodes(const WeakProblem& problem, ThinningMethod thin);

/// Names and values of all options in force.
Json options_in_force(const WeakRun& run);

}  // namespace wienertree::app
