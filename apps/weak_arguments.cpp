#include "weak_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "data_directory.hpp"
#include "formula_choice.hpp"
#include "input_files.hpp"
#include "tree_choices.hpp"
#include "wienertree/cubature/lie_formula.hpp"
#include "wienertree/tree/jacobi_transition.hpp"
#include "wienertree/tree/square_root_transition.hpp"
#include "wienertree/weak/conditional_price.hpp"

namespace wienertree::app {
namespace {

const Choices<KinkTreatment> treatments = {{"auto", KinkTreatment::automatic},
                                           {"last-step", KinkTreatment::last_step},
                                           {"kernel", KinkTreatment::kernel},
                                           {"sharp", KinkTreatment::sharp}};
const Choices<GridKind> grids = {{"uniform", GridKind::uniform}, {"kusuoka", GridKind::kusuoka}};
const Choices<bool> square_root_choices = {{"auto", true}, {"off", false}};
constexpr const char* discount_name = "discount_integral";

void add_texts(CLI::App& app, const std::string& name, std::vector<std::string>& target,
               const std::string& type, const std::string& help) {
  app.add_option_function<std::vector<std::string>>(
         name, [&target](const std::vector<std::string>& texts) { target = texts; }, help)
      ->type_name(type)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

// Times as "0.25,0.5,1", or one by one.
void add_horizons(CLI::App& app, std::vector<double>& target) {
  app.add_option_function<std::vector<std::string>>(
         "--horizon",
         [&target](const std::vector<std::string>& texts) {
           target.clear();
           for (const std::string& text : texts)
             for (std::size_t begin = 0; begin <= text.size();) {
               const std::size_t comma = std::min(text.find(',', begin), text.size());
               const std::string one = text.substr(begin, comma - begin);
               const double t = finite_number("--horizon", one);
               if (!(t > 0)) throw InputError("must be positive", "--horizon", one);
               if (!target.empty() && !(t > target.back()))
                 throw InputError("must ascend from time to time", "--horizon", one);
               target.push_back(t);
               begin = comma + 1;
             }
         },
         "T, the time at which it is averaged, or several, T1,T2,..: a row for each from one tree")
      ->type_name("X[,X..]")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->required();
}

void refuse_if(bool given, const char* option, const std::string& reason) {
  if (given) throw InputError(reason, option);
}

// "NAME=EXPR", but not the first half of a comparison: the language has none.
struct NamedIntegrand {
  std::string name, expression;
};
NamedIntegrand named_integrand(const std::string& text, const std::string& option) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw InputError("must be NAME=EXPR", option, text);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

// Recombination needs few nodes, since it keeps moments; random thinning many.
std::size_t default_nodes(ThinningMethod thin, std::size_t dimension) {
  if (thin == ThinningMethod::levelwise) return 100;  // one patch, whose cost grows with the cube
  if (!recombines(thin)) return 10000;
  return dimension == 1 ? 300 : dimension == 2 ? 1000 : 3000;
}

void refuse_inapplicable(const WeakArguments& a, ThinningMethod thin, bool random) {
  const std::string with_thinning = "has no meaning with --thin " + name_of(thinnings, thin);
  refuse_if(a.nodes && thin == ThinningMethod::none, "--nodes", with_thinning);
  refuse_if(a.order && !random, "--order", with_thinning);
  refuse_if(a.recombination_degree && !recombines(thin), "--recombination-degree", with_thinning);
  refuse_if(a.launches && !random, "--launches", with_thinning + ", which draws nothing");
  refuse_if(a.gamma && a.grid != GridKind::kusuoka, "--gamma", "has meaning only with --grid kusuoka");
  const std::string with_exact_flow = "has no meaning with --flow exact";
  refuse_if(a.flow == FlowMethod::exact && a.relative_tolerance, "--rtol", with_exact_flow);
  refuse_if(a.flow == FlowMethod::exact && a.absolute_tolerance, "--atol", with_exact_flow);
}

constexpr double default_kink_width = 0.4;
constexpr double default_patch_width = 1.5;
// 10 standard deviations of 10^6 steps.
constexpr std::size_t most_nodes_by_width = 100'000;

// More kinks than this in one payoff are not told apart by their sides.
constexpr std::size_t most_kinks = 64;

void choose_treatments(const WeakArguments& a, WeakProblem& problem) {
  KinkTreatment asked = a.kinks.value_or(a.kink_width ? KinkTreatment::kernel : KinkTreatment::automatic);
  if (asked == KinkTreatment::kernel && a.kink_width == 0.0) asked = KinkTreatment::sharp;
  refuse_if(a.kink_width && a.kinks && *a.kinks != KinkTreatment::kernel, "--kink-width",
            "has meaning only with --kinks kernel");
  const bool scales_wanted = asked == KinkTreatment::automatic || asked == KinkTreatment::kernel;
  WeakOptions sampled;
  sampled.thinning.method = a.thin.value_or(ThinningMethod::recombination);
  const bool by_weights_alone = is_random(sampled) && a.order == SiteOrder::tree;
  problem.scales.resize(problem.kinked.size());
  if (scales_wanted)
    problem.scales = kink_scales(problem.source.model(), problem.kinked, a.horizon(), problem.discount_state);
  for (std::size_t i = 0; i < problem.kinked.size(); ++i) {
    const KinkedFunction& f = problem.kinked[i];
    KinkTreatment& treatment = problem.treatment.emplace_back(asked);
    if (f.kinks.empty()) treatment = KinkTreatment::sharp;
    if (treatment == KinkTreatment::last_step && f.kinks.size() > most_kinks)
      throw InputError("has more than 64 kinks: --kinks kernel", "--payoff", problem.payoffs[i]);
    if (treatment != KinkTreatment::automatic) continue;
    // A tree that is sampled by weights alone moves N nodes a step; families would move all of their children.
    treatment = last_step_smooths(problem.scales[i]) && f.kinks.size() <= most_kinks && !by_weights_alone
                    ? KinkTreatment::last_step
                    : KinkTreatment::kernel;
  }
}

// Below this many nodes, threads wait for each other longer than they work.
constexpr std::size_t nodes_worth_threads = 5000;

}  // namespace

void add_weak_options(CLI::App& app, WeakArguments& a) {
  app.add_option("MODEL", a.model, "A bundled model or a TOML file")->required();
  add_texts(app, "--payoff", a.payoffs, "EXPR",
            "What is averaged: an expression of states and parameters; may be repeated");
  add_horizons(app, a.horizons);
  add_count(app, "--steps", a.steps, 1, "Steps of the tree", 1'000'000);
  add_count(app, "--degree", a.degree, 1, "Degree of the cubature formula [5]", 99);
  add_text(app, "--formula", a.formula, "NAME|FILE", "The cubature formula itself, instead of --degree");
  add_choice(app, "--grid", a.grid, grids, "Steps of equal length, or shrinking towards T [uniform]");
  add_number(app, "--gamma", a.gamma, Sign::positive,
             "Exponent of Kusuoka's grid t_i = T (1 - (1 - i/n)^gamma) [degree]");
  add_choice(app, "--thin", a.thin, thinnings, "How nodes are thinned out [recombination]");
  add_count(app, "--nodes", a.nodes, 1, "Nodes kept at each step [by thinning and dimension]", 1'000'000'000);
  add_number(app, "--patch-width", a.patch_width, Sign::positive,
             "Width of the patches of recombination in standard deviations of one step, for one state [1.5]");
  add_choice(app, "--order", a.order, orders, "Order in which random thinning visits nodes [spatial]");
  add_count(app, "--recombination-degree", a.recombination_degree, 1,
            "Moments that recombination keeps [by dimension]", 99);
  add_choice(app, "--flow", a.flow, flows, "How nodes move along a path [auto]");
  add_choice(
      app, "--square-roots", a.square_roots, square_root_choices,
      "Square-root processes and Heston's price by their exact transition [auto, where they are recognised]");
  add_number(app, "--rtol", a.relative_tolerance, Sign::positive, "Relative tolerance of the flow [1e-8]");
  add_number(app, "--atol", a.absolute_tolerance, Sign::positive, "Absolute tolerance of the flow [1e-10]");
  add_texts(app, "--average", a.averages, "STATE|NAME=EXPR",
            "Adds the state average_STATE (or NAME), the time average over [0, T]; may be repeated");
  add_texts(app, "--integral", a.integrals, "NAME=EXPR",
            "Adds the state NAME, the integral over [0, T]; may be repeated");
  add_choice(
      app, "--kinks", a.kinks, treatments,
      "How kinks and jumps of payoffs are averaged: by the law of the last step, smoothed, as they are "
      "[auto]");
  add_number(
      app, "--kink-width", a.kink_width, Sign::any,
      "Standard deviations over which max, min and abs are smoothed by --kinks kernel; 0: sharp [0.4]");
  add_text(app, "--discount", a.discount, "EXPR", "Payoffs are multiplied by exp(-integral of EXPR)");
  add_number(app, "--tolerance", a.tolerance, Sign::positive,
             "Chooses steps, degree, nodes or launches for this error, and estimates it part by part");
  app.add_flag("--richardson", a.richardson, "Extrapolate from n/2 and n steps");
  add_count(app, "--launches", a.launches, 1,
            "Independent runs of a random thinning, averaged [1, or by --tolerance]", 1'000'000);
  add_count(app, "--seed", a.seed, 0, "Seed of what is random [1]");
  add_count(app, "--threads", a.threads, 1,
            "Threads; results do not depend on them [1, or all for many nodes]", 1024);
  add_assignments(app, a.parameters);
}

namespace {

// Moves square-root processes and Jacobi's by their exact transition. A price that is lognormal given these is integrated out:
// payoffs become smooth functions of the variances and their integrals.
void use_exact_transition(const WeakArguments& a, WeakProblem& problem) {
  if (!a.square_roots.value_or(true)) return;
  const bool other_way = a.formula || a.flow || a.relative_tolerance || a.absolute_tolerance ||
                         a.degree.value_or(5) > 7 ||
                         a.thin.value_or(ThinningMethod::recombination) != ThinningMethod::recombination;
  const auto& structure = problem.source.square_roots();
  if (other_way) return;
  if (!structure) {
    if (const auto jacobi = jacobi_process(problem.source.model()))
      problem.transition = std::make_shared<JacobiTransition>(*jacobi);
    return;
  }
  if (!structure->price) {
    SquareRootStructure own = *structure;
    own.nonnegative_integrals = false;
    problem.transition = std::make_shared<SquareRootTransition>(std::move(own));
    return;
  }
  const ConditionalPrice price(*structure, problem.source.model().initial);
  for (std::size_t i = 0; i < problem.kinked.size(); ++i) {
    const KinkedFunction& f = problem.kinked[i];
    std::vector<BatchFunction>& times = problem.by_time.emplace_back();
    for (const double T : a.horizons)
      times.push_back(problem.discount_state ? price.average(f.exact, f.kinks, T)
                                             : price.average_of_rest(f, T));
    KinkedFunction smooth;
    smooth.exact = times.back();
    problem.kinked[i] = std::move(smooth);
  }
  if (problem.discount_state) problem.discount_state = price.place(*problem.discount_state);
  problem.source = problem.source.without_price();
  problem.transition = std::make_shared<SquareRootTransition>(*problem.source.square_roots());
}

}  // namespace

WeakProblem weak_problem(const WeakArguments& a) {
  return weak_problem(a, with_inputs(TextModel::load(model_file(a.model).string(), a.parameters), a.inputs));
}

WeakProblem weak_problem(const WeakArguments& a, const TextModel& model) {
  if (a.kink_width && *a.kink_width < 0)
    throw InputError("must not be negative", "--kink-width", fmt::format("{}", *a.kink_width));
  if (model.model().inputs) model.model().inputs->require_known();
  if (a.payoffs.empty()) throw InputError("is needed at least once", "--payoff");
  if (a.horizons.size() > 1 && !a.averages.empty())
    throw InputError("has one time to divide by, not several: take --integral", "--average",
                     a.averages.front());
  std::vector<RunningIntegral> integrals;
  for (const std::string& text : a.integrals) {
    const auto [name, expression] = named_integrand(text, "--integral");
    integrals.push_back({name, expression, "--integral"});
  }
  for (const std::string& text : a.averages) {
    const bool named = text.find('=') != std::string::npos;
    const auto [name, expression] =
        named ? named_integrand(text, "--average") : NamedIntegrand{"average_" + text, text};
    model.compile(expression, "--average");  // for the place of a mistake in it
    integrals.push_back({name, fmt::format("({})/({:.17g})", expression, a.horizon()), "--average"});
  }
  WeakProblem problem{model, {}, a.payoffs, {}, {}, {}, {}, 0, {}, {}};
  if (a.discount) {
    if (const auto constant = model.constant(*a.discount, "--discount")) {
      problem.discount_rate = *constant;
    } else {
      problem.discount_state =
          model.model().state_dimension() - (model.model().has_clock ? 1 : 0) + integrals.size();
      integrals.push_back({discount_name, *a.discount, "--discount"});
    }
  }
  if (!integrals.empty() || model.model().observation != ObservationKind::none)
    problem.source = model.with_integrals(integrals);
  for (const RunningIntegral& integral : integrals) problem.added.push_back(integral.name);
  for (const std::string& payoff : a.payoffs)
    problem.kinked.push_back(problem.source.compile_kinked(payoff, "--payoff"));
  use_exact_transition(a, problem);
  choose_treatments(a, problem);
  return problem;
}

std::vector<std::vector<WeakPayoff>> averaged_payoffs(const WeakArguments& a, const WeakProblem& problem,
                                                      std::size_t rungs) {
  const bool kernel = std::find(problem.treatment.begin(), problem.treatment.end(), KinkTreatment::kernel) !=
                      problem.treatment.end();
  std::vector<std::vector<WeakPayoff>> averaged;
  for (std::size_t rung = 0; rung < (kernel ? rungs : 1); ++rung) {
    std::vector<WeakPayoff>& payoffs = averaged.emplace_back();
    for (std::size_t i = 0; i < problem.kinked.size(); ++i) {
      const KinkedFunction& f = problem.kinked[i];
      const double width =
          a.kink_width.value_or(default_kink_width) * std::exp2(-static_cast<double>(rung) / 4);
      if (problem.treatment[i] == KinkTreatment::last_step)
        payoffs.emplace_back(f);
      else if (problem.treatment[i] == KinkTreatment::kernel)
        payoffs.emplace_back(smooth_payoff(f, problem.scales[i], width));
      else
        payoffs.emplace_back(f.exact);
      payoffs.back().discount_rate = problem.discount_rate;
      if (!problem.by_time.empty()) payoffs.back().at_times = problem.by_time[i];
    }
  }
  return averaged;
}

void note_kinks(const WeakArguments& a, const WeakProblem& problem, Json& options) {
  std::optional<KinkTreatment> common;
  bool kinks = false, kernel = false;
  for (std::size_t i = 0; i < problem.kinked.size(); ++i) {
    if (problem.kinked[i].kinks.empty()) continue;
    if (!kinks)
      common = problem.treatment[i];
    else if (common != problem.treatment[i])
      common.reset();
    kinks = true;
    kernel = kernel || problem.treatment[i] == KinkTreatment::kernel;
  }
  if (!kinks) return;
  options["kinks"] = name_of(treatments, common.value_or(KinkTreatment::automatic));
  if (kernel) options["kink-width"] = a.kink_width.value_or(default_kink_width);
}

std::vector<CubatureFormula> weak_formulas(const WeakArguments& a, const WeakProblem& problem) {
  const std::size_t p = problem.source.model().noise_dimension();
  if (choose_lie_formula(a.degree, a.formula, p))
    throw InputError("chooses among formulas of paths: give --steps with this one", "--tolerance",
                     *a.formula);
  if (a.degree || a.formula) return {choose_formula(a.degree, a.formula, p)};
  std::vector<CubatureFormula> formulas;
  // Of the exact transition the best rule costs hardly more than the others.
  const std::vector<int> degrees = formula_degrees(p);
  if (problem.transition) return {choose_formula(std::min(7, degrees.back()), {}, p)};
  // The highest degree has none above it to be compared with.
  for (const int degree : degrees)
    if (degree > 3 && (degree < degrees.back() || degree == 5))
      formulas.push_back(choose_formula(static_cast<std::uint64_t>(degree), {}, p));
  return formulas;
}

std::vector<CubatureFormula> weak_guards(const WeakProblem& problem) {
  const std::size_t p = problem.source.model().noise_dimension();
  std::vector<CubatureFormula> guards;
  for (const int degree : formula_degrees(p))
    if (degree <= 7 || !problem.transition)
      guards.push_back(choose_formula(static_cast<std::uint64_t>(degree), {}, p));
  return guards;
}

DrivenFormula weak_formula(const WeakArguments& a, const WeakProblem& problem) {
  const std::size_t p = problem.source.model().noise_dimension();
  if (const auto lie = choose_lie_formula(a.degree, a.formula, p)) {
    BracketFormula driven = bracket_formula(*lie);
    return {std::move(driven.formula), problem.source.with_brackets(driven.brackets)};
  }
  return {choose_formula(a.degree, a.formula, p), problem.source.model()};
}

WeakRun weak_run(const WeakArguments& a, const WeakProblem& problem, CubatureFormula formula) {
  const Model& model = problem.source.model();
  WeakRun run;
  WeakOptions& o = run.options;
  o.thinning.method = a.thin.value_or(ThinningMethod::recombination);
  const bool random = is_random(o);
  refuse_inapplicable(a, o.thinning.method, random);
  if (a.tolerance) {
    refuse_if(a.steps.has_value(), "--steps", "is chosen by --tolerance: give one of them");
    refuse_if(a.richardson, "--richardson", "is part of --tolerance");
  } else if (!a.steps) {
    throw InputError("give the number of steps, or the error with --tolerance", "--steps");
  }
  refuse_if(a.richardson && a.steps < 2, "--richardson", "needs at least 2 --steps");
  o.formula = std::move(formula);
  const std::size_t folded = problem.discount_state ? 1 : 0;
  o.nodes = a.nodes.value_or(default_nodes(o.thinning.method, model.reported_dimension() - folded));
  const bool line = model.reported_dimension() - folded == 1;
  refuse_if(a.patch_width && (o.thinning.method != ThinningMethod::recombination || !line), "--patch-width",
            "is for recombination where there is one state");
  refuse_if(a.patch_width && a.nodes, "--patch-width", "decides the number of nodes: give it or --nodes");
  if (line && o.thinning.method == ThinningMethod::recombination && !a.nodes) {
    o.patch_width = a.patch_width.value_or(default_patch_width);
    o.nodes = most_nodes_by_width;
  }
  o.thinning.order = a.order.value_or(SiteOrder::spatial);
  o.thinning.recombination_degree = static_cast<int>(a.recombination_degree.value_or(0));
  o.flow = a.flow.value_or(FlowMethod::automatic);
  o.tolerance.relative = a.relative_tolerance.value_or(o.tolerance.relative);
  o.tolerance.absolute = a.absolute_tolerance.value_or(o.tolerance.absolute);
  o.seed = a.seed.value_or(1);
  o.discount_state = problem.discount_state;
  o.transition = problem.transition;
  for (const KinkedFunction& payoff : problem.kinked)
    if (!payoff.kinks.empty() && !o.finest_along) o.finest_along = payoff.kinks.front();
  const bool many =
      o.thinning.method == ThinningMethod::none || (o.nodes >= nodes_worth_threads && o.patch_width == 0);
  o.threads =
      static_cast<unsigned>(a.threads.value_or(many ? std::max(1U, std::thread::hardware_concurrency()) : 1));
  run.grid = a.grid.value_or(GridKind::uniform);
  run.horizon = a.horizon();
  if (a.horizons.size() > 1) run.horizons = a.horizons;
  run.kinks_at_times = a.horizons.size() > 1 &&
                       std::ranges::any_of(problem.kinked, [](const auto& f) { return !f.kinks.empty(); });
  run.jumps = jumps_inside(model, run.horizon);
  run.steps = a.steps.value_or(0);
  run.gamma = a.gamma.value_or(o.formula.degree);
  run.launches = static_cast<std::uint32_t>(a.launches.value_or(1));
  run.richardson = a.richardson;
  return run;
}

std::size_t starting_nodes(const WeakProblem& problem, ThinningMethod thin) {
  if (thin == ThinningMethod::levelwise) return 50;
  const std::size_t d = problem.source.model().reported_dimension() - (problem.discount_state ? 1 : 0);
  return d == 1 ? 100 : d == 2 ? 400 : 800;
}

Json options_in_force(const WeakRun& run) {
  const WeakOptions& o = run.options;
  Json json;
  json["horizon"] = run.horizon;
  if (run.horizons.size() > 1) json["horizon"] = run.horizons;
  json["steps"] = run.steps;
  json["degree"] = o.formula.degree;
  json["formula"] = o.formula.name;
  json["grid"] = name_of(grids, run.grid);
  if (run.grid == GridKind::kusuoka) json["gamma"] = run.gamma;
  json["thin"] = name_of(thinnings, o.thinning.method);
  if (o.patch_width > 0)
    json["patch-width"] = o.patch_width;
  else if (o.thinning.method != ThinningMethod::none)
    json["nodes"] = o.nodes;
  if (is_random(o)) json["order"] = name_of(orders, o.thinning.order);
  if (o.thinning.recombination_degree > 0) json["recombination-degree"] = o.thinning.recombination_degree;
  json["flow"] = name_of(flows, o.flow);
  if (o.flow != FlowMethod::exact) {
    json["rtol"] = o.tolerance.relative;
    json["atol"] = o.tolerance.absolute;
  }
  json["richardson"] = run.richardson;
  if (is_random(o)) {
    json["seed"] = o.seed;
    json["launches"] = run.launches;
  }
  return json;
}

}  // namespace wienertree::app
