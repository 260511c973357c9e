#include "wienertree/run/recommended_options.hpp"

#include <algorithm>
#include <thread>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/filter/component_filter.hpp"
#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

// Recombination needs few nodes, since it keeps moments; random thinning many.
std::size_t recommended_nodes(FilterMethod method, ThinningMethod thin, std::size_t dimension) {
  if (method == FilterMethod::grid) return FilterOptions{}.grid_points;
  if (method == FilterMethod::euler || method == FilterMethod::weighted) return 10000;
  if (method == FilterMethod::gaussian_mixture) return 1000;
  if (recombines(thin)) return dimension == 1 ? 60 : dimension == 2 ? 300 : 600;
  return dimension == 1 ? 1000 : 10000;
}

// Discrete observations leave no error but the formula's: degree 7, where a formula is shipped, costs two to
// four times degree 5 and errs a tenth or less (docs/volatility.md). A functional of a continuous record is
// of order 2, which degree 5 matches.
int recommended_degree(const Model& model) {
  constexpr std::size_t most_motions = 3;
  if (model.observation != ObservationKind::discrete) return 5;
  return model.noise_dimension() <= most_motions ? 7 : 5;
}

// Below this many nodes, threads wait for each other longer than they work.
constexpr std::size_t nodes_worth_threads = 5000;

// Whether something was given that a filter in closed form has no use for.
bool asks_for_nodes(const GivenOptions& g) {
  return g.degree || g.nodes || g.launches || g.recombination_degree || g.formula || g.thin || g.order ||
         g.prune_weights || g.functional || g.flow || g.relative_tolerance || g.absolute_tolerance ||
         g.ess_threshold || g.on_node_failure;
}

}  // namespace

std::optional<FilterMethod> exact_method(const Model& model) {
  switch (model.exact_filter) {
    case ExactFilter::none:
      return {};
    case ExactFilter::benes:
      return FilterMethod::benes;
    case ExactFilter::kalman_bucy:
      return FilterMethod::kalman_bucy;
    case ExactFilter::kalman:
      return FilterMethod::kalman;
  }
  return {};
}

bool moves_particles(FilterMethod method) {
  return method == FilterMethod::euler || method == FilterMethod::gaussian_mixture ||
         method == FilterMethod::weighted;
}

bool keeps_nodes(FilterMethod method) {
  return method == FilterMethod::klv || method == FilterMethod::full_tree || moves_particles(method);
}

FilterMethod recommended_method(const Model& model, const GivenOptions& given) {
  if (given.method) return *given.method;
  return asks_for_nodes(given) ? FilterMethod::klv : exact_method(model).value_or(FilterMethod::klv);
}

ThinningMethod recommended_thinning(const GivenOptions& given, FilterMethod method) {
  // Recombination merges states, which a likelihood carried along each path does not allow.
  const bool carried = given.prune_weights == PruneWeights::cubature;
  if (method == FilterMethod::klv)
    return given.thin.value_or(carried ? ThinningMethod::tbba : ThinningMethod::recombination);
  if (method == FilterMethod::euler) return given.thin.value_or(ThinningMethod::systematic);
  if (method == FilterMethod::gaussian_mixture) return given.thin.value_or(ThinningMethod::tbba);
  return ThinningMethod::none;
}

Conditioning recommended_conditioning(const Model& model, const GivenOptions& given, FilterMethod method) {
  if (given.conditioning) return *given.conditioning;
  const bool carried = given.prune_weights == PruneWeights::cubature || given.ess_threshold;
  if (method != FilterMethod::klv || model.observation != ObservationKind::discrete || carried)
    return Conditioning::children;
  const std::size_t d = model.reported_dimension();
  // Families grow by the formula, the flow and the thinning that are given; components by none of them.
  if (d == 1) return Conditioning::families;
  const bool own_way =
      given.degree || given.formula || given.recombination_degree || given.flow || given.thin;
  const bool absorbs = std::ranges::any_of(
      model.bounds, [](const StateBound& b) { return b.bounded() && b.boundary == Boundary::absorb; });
  return d <= std::size_t{most_component_states} && !own_way && !absorbs ? Conditioning::components
                                                                         : Conditioning::children;
}

FilterSetup recommended_options(const Model& model, const GivenOptions& given,
                                const std::filesystem::path& formulas) {
  FilterSetup setup;
  FilterOptions& o = setup.options;
  o.method = recommended_method(model, given);
  if (o.method == FilterMethod::klv && given.thin == ThinningMethod::none) o.method = FilterMethod::full_tree;
  o.thinning.method = recommended_thinning(given, o.method);
  o.conditioning = recommended_conditioning(model, given, o.method);
  const std::size_t d = model.reported_dimension();
  const std::size_t nodes = given.nodes.value_or(o.conditioning == Conditioning::components
                                                     ? default_components(d)
                                                     : recommended_nodes(o.method, o.thinning.method, d));
  (o.method == FilterMethod::grid ? o.grid_points : o.nodes) = nodes;
  if (!keeps_nodes(o.method)) return setup;
  if (!moves_particles(o.method)) {
    const int degree = given.degree ? static_cast<int>(*given.degree) : recommended_degree(model);
    o.formula = given.formula ? *given.formula
                              : find_formula(degree, static_cast<int>(model.noise_dimension()), formulas);
  }
  o.thinning.order = given.order.value_or(SiteOrder::spatial);
  o.thinning.recombination_degree = static_cast<int>(given.recombination_degree.value_or(0));
  o.prune_weights = given.prune_weights.value_or(PruneWeights::likelihood);
  o.functional = given.functional.value_or(FunctionalMethod::second_order);
  o.flow = given.flow.value_or(FlowMethod::automatic);
  o.tolerance.relative = given.relative_tolerance.value_or(o.tolerance.relative);
  o.tolerance.absolute = given.absolute_tolerance.value_or(o.tolerance.absolute);
  o.on_node_failure = given.on_node_failure.value_or(OnNodeFailure::stop);
  o.ess_threshold = given.ess_threshold.value_or(o.ess_threshold);
  o.alpha = given.alpha;
  o.beta = given.beta.value_or(o.beta);
  o.seed = given.seed.value_or(1);
  const bool many = o.method == FilterMethod::full_tree || o.nodes >= nodes_worth_threads;
  o.threads = static_cast<unsigned>(
      given.threads.value_or(many ? std::max(1U, std::thread::hardware_concurrency()) : 1));
  setup.launches = static_cast<std::uint32_t>(given.launches.value_or(1));
  setup.random =
      moves_particles(o.method) || (o.method == FilterMethod::klv && !recombines(o.thinning.method));
  return setup;
}

}  // namespace wienertree
