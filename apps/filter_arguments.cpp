#include "filter_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data_directory.hpp"
#include "formula_choice.hpp"
#include "tree_choices.hpp"
#include "wienertree/filter/filter_memory.hpp"
#include "wienertree/filter/gaussian_mixture_filter.hpp"

namespace wienertree::app {
namespace {

const Choices<FilterMethod> methods = {{"klv", FilterMethod::klv},
                                       {"full-tree", FilterMethod::full_tree},
                                       {"euler", FilterMethod::euler},
                                       {"gaussian-mixture", FilterMethod::gaussian_mixture},
                                       {"weighted", FilterMethod::weighted},
                                       {"benes", FilterMethod::benes},
                                       {"kalman-bucy", FilterMethod::kalman_bucy},
                                       {"kalman", FilterMethod::kalman},
                                       {"grid", FilterMethod::grid}};
const Choices<PruneWeights> prunings = {{"likelihood", PruneWeights::likelihood},
                                        {"cubature", PruneWeights::cubature}};
const Choices<FunctionalMethod> functionals = {{"picard", FunctionalMethod::picard},
                                               {"trapezoid", FunctionalMethod::trapezoid},
                                               {"second-order", FunctionalMethod::second_order}};
const Choices<Conditioning> conditionings = {{"children", Conditioning::children},
                                             {"families", Conditioning::families},
                                             {"components", Conditioning::components}};
const Choices<OnNodeFailure> failures = {{"stop", OnNodeFailure::stop}, {"drop", OnNodeFailure::drop}};

// An option given where it means nothing is a mistake worth telling.
void refuse_if(bool given, const char* option, const std::string& reason) {
  if (given) throw InputError(reason, option);
}

void refuse_tree_options(const FilterArguments& a, const std::string& reason) {
  refuse_if(a.degree.has_value(), "--degree", reason);
  refuse_if(a.formula_name.has_value(), "--formula", reason);
  refuse_if(a.prune_weights.has_value(), "--prune-weights", reason);
  refuse_if(a.conditioning.has_value(), "--conditioning", reason);
  refuse_if(a.recombination_degree.has_value(), "--recombination-degree", reason);
  refuse_if(a.flow.has_value(), "--flow", reason);
  refuse_if(a.relative_tolerance.has_value(), "--rtol", reason);
  refuse_if(a.absolute_tolerance.has_value(), "--atol", reason);
  refuse_if(a.on_node_failure.has_value(), "--on-node-failure", reason);
}

void refuse_random_options(const FilterArguments& a, const std::string& reason) {
  refuse_if(a.launches.has_value(), "--launches", reason + ": it is deterministic");
}

void refuse_thinning_options(const FilterArguments& a, const std::string& reason) {
  refuse_if(a.thin.has_value() && a.thin != ThinningMethod::none, "--thin", reason);
  refuse_if(a.order.has_value(), "--order", reason);
  refuse_if(a.prune_weights.has_value(), "--prune-weights", reason);
  refuse_if(a.recombination_degree.has_value(), "--recombination-degree", reason);
  refuse_random_options(a, reason);
}

// Conditioned families and components are for discrete observations, thinned with their likelihoods.
void refuse_conditioning(const FilterArguments& a, const Model& model, FilterMethod method,
                         ThinningMethod thin) {
  if (!a.conditioning || a.conditioning == Conditioning::children) return;
  const std::string chosen = "--conditioning " + name_of(conditionings, *a.conditioning);
  refuse_if(method != FilterMethod::klv, chosen.c_str(),
            thin == ThinningMethod::none ? "has no meaning with --thin none"
                                         : "has no meaning with --method " + name_of(methods, method));
  refuse_if(model.observation != ObservationKind::discrete, chosen.c_str(),
            "has meaning only for discrete observations");
  refuse_if(a.prune_weights == PruneWeights::cubature, chosen.c_str(),
            "has no meaning with --prune-weights cubature, where likelihoods never decide");
  refuse_if(a.ess_threshold.has_value(), "--ess-threshold",
            "has no meaning with " + chosen + ", which lets likelihoods decide at every step");
  const bool line = model.reported_dimension() == 1;
  refuse_if(a.conditioning == Conditioning::families && !line, chosen.c_str(),
            fmt::format("is for models of one state, and this one has {}", model.reported_dimension()));
  refuse_if(a.conditioning == Conditioning::components && line, chosen.c_str(),
            "is for models of several states; with one, families do the same");
}

void refuse_inapplicable(const FilterArguments& a, const Model& model, FilterMethod method,
                         ThinningMethod thin) {
  const std::string with_method = "has no meaning with --method " + name_of(methods, method);
  const std::string with_thinning = "has no meaning with --thin " + name_of(thinnings, thin);
  refuse_if(a.ess_threshold && method != FilterMethod::euler && method != FilterMethod::klv,
            "--ess-threshold", with_method);
  refuse_if(a.ess_threshold && a.prune_weights == PruneWeights::cubature, "--ess-threshold",
            "has no meaning with --prune-weights cubature, where likelihoods never decide");
  refuse_if(a.alpha && method != FilterMethod::gaussian_mixture, "--alpha", with_method);
  refuse_if(a.beta && method != FilterMethod::gaussian_mixture, "--beta", with_method);
  refuse_if(a.functional && model.observation != ObservationKind::continuous, "--functional",
            "has meaning only for continuous observations");
  refuse_conditioning(a, model, method, thin);
  if (moves_particles(method)) {
    refuse_tree_options(a, with_method);
    refuse_if(recombines(thin), "--thin",
              name_of(thinnings, thin) + " " + with_method + ", which counts particles");
    refuse_if(a.thin && method == FilterMethod::weighted, "--thin", with_method + ", which never resamples");
    refuse_if(thin == ThinningMethod::none && method == FilterMethod::gaussian_mixture, "--thin",
              "none " + with_method + ", whose corrections draw offspring");
    refuse_if(a.order && thin == ThinningMethod::none, "--order", with_thinning);
    return;
  }
  if (!keeps_nodes(method)) {
    refuse_tree_options(a, with_method);
    refuse_thinning_options(a, with_method);
    refuse_if(a.nodes && method != FilterMethod::grid, "--nodes", with_method);
    refuse_if(a.functional.has_value(), "--functional", with_method);
    return;
  }
  if (method == FilterMethod::full_tree) {
    refuse_thinning_options(a, with_method);
    refuse_if(a.nodes.has_value() && !model.initial_law, "--nodes", with_method + " and a fixed start");
  } else if (recombines(thin)) {
    refuse_if(a.ess_threshold.has_value(), "--ess-threshold",
              with_thinning + ", which lets likelihoods decide at every step");
    refuse_if(a.order.has_value(), "--order", with_thinning);
    refuse_if(a.prune_weights == PruneWeights::cubature, ("--thin " + name_of(thinnings, thin)).c_str(),
              "merges states, and does not go with --prune-weights cubature");
    refuse_random_options(a, with_thinning);
  } else {
    refuse_if(a.recombination_degree.has_value(), "--recombination-degree", with_thinning);
  }
  const std::string with_exact_flow = "has no meaning with --flow exact";
  refuse_if(a.flow == FlowMethod::exact && a.relative_tolerance, "--rtol", with_exact_flow);
  refuse_if(a.flow == FlowMethod::exact && a.absolute_tolerance, "--atol", with_exact_flow);
}

}  // namespace

void add_tree_options(CLI::App& app, FilterArguments& a) {
  add_count(app, "--degree", a.degree, 1,
            "Degree of the cubature formula [5, or 7 for discrete observations of up to 3 Brownian motions]",
            99);
  add_text(app, "--formula", a.formula_name, "NAME|FILE", "The cubature formula itself, instead of --degree");
  add_count(app, "--nodes", a.nodes, 1,
            "Nodes kept at each step, or cells of the grid [by method and dimension]", 1'000'000'000);
  add_choice(app, "--thin", a.thin, thinnings, "How nodes are thinned out");
  add_choice(app, "--order", a.order, orders, "Order in which random thinning visits nodes [spatial]");
  add_count(app, "--recombination-degree", a.recombination_degree, 1,
            "Moments that recombination keeps [by dimension]", 99);
  add_choice(app, "--prune-weights", a.prune_weights, prunings,
             "Weights that decide which nodes stay [likelihood]");
  add_choice(app, "--conditioning", a.conditioning, conditionings,
             "What a discrete observation conditions: children of nodes, their families, or components with "
             "covariance [families for one state]");
  add_choice(app, "--functional", a.functional, functionals,
             "Likelihood of a step of a continuous observation [second-order]");
  add_choice(app, "--flow", a.flow, flows, "How nodes move along a path [auto]");
  add_number(app, "--rtol", a.relative_tolerance, Sign::positive, "Relative tolerance of the flow [1e-8]");
  add_number(app, "--atol", a.absolute_tolerance, Sign::positive, "Absolute tolerance of the flow [1e-10]");
  add_choice(app, "--on-node-failure", a.on_node_failure, failures,
             "A node that cannot be moved stops the run, or is dropped [stop]");
  add_count(app, "--seed", a.seed, 0, "Seed of what is random [1]");
  add_count(app, "--threads", a.threads, 1,
            "Threads; results do not depend on them [1, or all for many nodes]", 1024);
}

void add_filter_options(CLI::App& app, FilterArguments& a) {
  add_choice(app, "--method", a.method, methods,
             "The filter [exact where the model has an exact one, else klv]");
  add_tree_options(app, a);
  add_number(app, "--ess-threshold", a.ess_threshold, Sign::any,
             "Random thinning goes by likelihoods when the effective sample size is at most this part "
             "of all [1]");
  add_number(app, "--alpha", a.alpha, Sign::any,
             "gaussian-mixture: part of the noise that spreads the Gaussians, 0 to 1 [1/sqrt(nodes)]");
  add_number(app, "--beta", a.beta, Sign::any,
             "gaussian-mixture: offspring have the variance alpha beta [0]");
  add_count(app, "--launches", a.launches, 1, "Independent runs of a random method, averaged [1]", 1'000'000);
}

void add_record_steps(CLI::App& app, std::optional<std::uint64_t>& steps) {
  add_count(app, "--steps", steps, 1, "Steps [one a row, but at most 200 of a continuous record]",
            1'000'000'000);
}

void add_accuracy_options(CLI::App& app, AccuracyArguments& a) {
  add_number(app, "--tolerance", a.tolerance, Sign::positive,
             "Largest error wanted, in posterior standard deviations; of the log evidence as it is [0.02]");
  add_number(app, "--work", a.work, Sign::positive,
             "Node-steps that the search for it may take [4e8, about 45 s of one core]");
}

ControlOptions control_options(const AccuracyArguments& accuracy, const FilterArguments& filter,
                               std::optional<std::uint64_t> steps, std::optional<std::uint64_t> moments) {
  ControlOptions control;
  control.tolerance = accuracy.tolerance.value_or(control.tolerance);
  control.work = accuracy.work.value_or(control.work);
  control.highest_moment = moments.value_or(0);
  if (steps) control.steps = *steps;
  control.nodes_given = filter.nodes.has_value();
  control.formulas = formulas_directory(false);
  return control;
}

void add_moments(CLI::App& app, std::optional<std::uint64_t>& moments) {
  add_count(app, "--moments", moments, 2, "Also the raw moments E[x^2] .. E[x^K]", 20);
}

std::string method_name(FilterMethod method) { return name_of(methods, method); }

FilterSetup filter_setup(const FilterArguments& a, const Model& model) {
  GivenOptions given = a;
  if (a.formula_name && !given.formula) given.formula.emplace();  // to be loaded for a tree
  FilterMethod method = recommended_method(model, given);
  given.method = method;
  if (method == FilterMethod::klv && a.thin == ThinningMethod::none) method = FilterMethod::full_tree;
  refuse_inapplicable(a, model, method, recommended_thinning(a, method));
  const bool tree = method == FilterMethod::klv || method == FilterMethod::full_tree;
  if (tree && a.formula_name)
    given.formula = choose_formula(a.degree, a.formula_name, model.noise_dimension());
  FilterSetup setup = recommended_options(model, given, formulas_directory(tree));
  refuse_oversized_filter(model, setup.options, setup.launches);
  return setup;
}

Json options_in_force(const FilterSetup& setup, const Model& model) {
  const FilterOptions& o = setup.options;
  const bool tree = o.method == FilterMethod::klv || o.method == FilterMethod::full_tree;
  Json json;
  json["method"] = name_of(methods, o.method);
  if (o.method == FilterMethod::grid) json["nodes"] = o.grid_points;
  if (!keeps_nodes(o.method)) return json;
  if (tree) {
    json["degree"] = o.formula.degree;
    json["formula"] = o.formula.name;
  }
  if (o.method != FilterMethod::full_tree) {
    json["nodes"] = o.nodes;
    if (o.method != FilterMethod::weighted) json["thin"] = name_of(thinnings, o.thinning.method);
    if (setup.random && o.thinning.method != ThinningMethod::none)
      json["order"] = name_of(orders, o.thinning.order);
    if (o.thinning.recombination_degree > 0) json["recombination-degree"] = o.thinning.recombination_degree;
  }
  if (o.method == FilterMethod::klv) json["prune-weights"] = name_of(prunings, o.prune_weights);
  if (o.method == FilterMethod::klv && model.observation == ObservationKind::discrete)
    json["conditioning"] = name_of(conditionings, o.conditioning);
  const bool likelihoods_decide = o.method == FilterMethod::klv && o.conditioning == Conditioning::children &&
                                  setup.random && o.prune_weights == PruneWeights::likelihood;
  if (o.method == FilterMethod::euler || likelihoods_decide) json["ess-threshold"] = o.ess_threshold;
  if (o.method == FilterMethod::gaussian_mixture) {
    json["alpha"] = mixture_alpha(o);
    json["beta"] = o.beta;
  }
  if (model.observation == ObservationKind::continuous)
    json["functional"] = name_of(functionals, o.functional);
  if (tree) {
    json["flow"] = name_of(flows, o.flow);
    json["rtol"] = o.tolerance.relative;
    json["atol"] = o.tolerance.absolute;
    json["on-node-failure"] = name_of(failures, o.on_node_failure);
  }
  if (setup.random) {
    json["seed"] = o.seed;
    json["launches"] = setup.launches;
  }
  return json;
}

std::optional<std::size_t> steps_in_force(const FilterSetup& setup, std::optional<std::uint64_t> given) {
  if (given || setup.options.conditioning == Conditioning::children) return given;
  return 0;
}

std::string describe(const FilterSetup& setup) {
  const FilterOptions& o = setup.options;
  if (o.method == FilterMethod::grid) return fmt::format("grid filter, {} cells", o.grid_points);
  if (!keeps_nodes(o.method)) return "exact " + method_name(o.method) + " filter";
  if (o.method == FilterMethod::full_tree) return fmt::format("full tree, degree {}", o.formula.degree);
  if (o.method == FilterMethod::weighted)
    return fmt::format("weighted particle filter, {} particles", o.nodes);
  const char* what = o.method == FilterMethod::euler              ? "particles"
                     : o.method == FilterMethod::gaussian_mixture ? "Gaussians"
                                                                  : "nodes";
  const std::string nodes = fmt::format("{} {} by {}", o.nodes, what, name_of(thinnings, o.thinning.method));
  if (o.method == FilterMethod::euler) return "Euler particle filter, " + nodes;
  if (o.method == FilterMethod::gaussian_mixture) return "Gaussian-mixture filter, " + nodes;
  return fmt::format("KLV filter, degree {}, {}", o.formula.degree, nodes);
}

}  // namespace wienertree::app
