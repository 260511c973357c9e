#include "wienertree/filter/filter.hpp"

#include <fmt/format.h>

#include <cmath>

#include "wienertree/filter/benes_filter.hpp"
#include "wienertree/filter/component_filter.hpp"
#include "wienertree/filter/euler_filter.hpp"
#include "wienertree/filter/family_filter.hpp"
#include "wienertree/filter/filter_memory.hpp"
#include "wienertree/filter/gaussian_mixture_filter.hpp"
#include "wienertree/filter/grid_filter.hpp"
#include "wienertree/filter/kalman_bucy_filter.hpp"
#include "wienertree/filter/kalman_filter.hpp"
#include "wienertree/filter/klv_filter.hpp"
#include "wienertree/filter/small_matrix.hpp"
#include "wienertree/filter/weighted_filter.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {
namespace {

void check_node_options(const FilterOptions& options) {
  if (options.nodes == 0) throw InputError("must be at least 1", "nodes", "0");
  if (options.threads == 0) throw InputError("must be at least 1", "threads", "0");
}

void check_ess_threshold(const FilterOptions& options) {
  if (!(options.ess_threshold >= 0 && options.ess_threshold <= 1))
    throw InputError("must lie between 0 and 1", "ess-threshold", fmt::format("{}", options.ess_threshold));
}

void check_tree_options(const Model& model, const FilterOptions& options) {
  check_node_options(options);
  check_formula_fits(options.formula, model);
  if (options.prune_weights == PruneWeights::cubature && recombines(options.thinning.method))
    throw InputError(
        "recombination merges states, and a likelihood carried along belongs to a whole path: thin "
        "cubature weights by a method that counts, tbba for one",
        "prune-weights", "cubature");
  check_ess_threshold(options);
  if (options.ess_threshold < 1 && recombines(options.thinning.method))
    throw InputError("recombination merges states, and a likelihood carried along belongs to a whole path",
                     "ess-threshold", fmt::format("{}", options.ess_threshold));
  if (!(options.memory_limit > 0))
    throw InputError("must be positive", "memory limit", fmt::format("{}", options.memory_limit));
}

void check_component_options(const Model& model, const FilterOptions& options) {
  check_node_options(options);
  if (model.observation != ObservationKind::discrete)
    throw InputError("components are conditioned on discrete observations", "conditioning", "components");
  const std::size_t d = model.reported_dimension();
  if (d < 2 || d > static_cast<std::size_t>(most_component_states))
    throw InputError(fmt::format("components are kept for 2 to {} states", most_component_states),
                     "conditioning", fmt::format("{} states", d));
  for (std::size_t i = 0; i < d; ++i)
    if (model.bounds[i].bounded() && model.bounds[i].boundary == Boundary::absorb)
      throw InputError("no Gaussian is absorbed at a bound: use conditioning children", "conditioning",
                       model.state_names[i]);
  if (!(options.substep_tolerance > 0))
    throw InputError("must be positive", "substep tolerance", fmt::format("{}", options.substep_tolerance));
}

void check_particle_options(const FilterOptions& options) {
  check_node_options(options);
  check_ess_threshold(options);
  if (recombines(options.thinning.method))
    throw InputError("particles need a thinning that counts them; recombination keeps weights", "thin",
                     std::string(make_thinning(options.thinning)->name()));
}

void check_mixture_options(const FilterOptions& options) {
  check_particle_options(options);
  if (options.thinning.method == ThinningMethod::none)
    throw InputError("the Gaussian-mixture filter needs a thinning for its corrections", "thin", "none");
  if (options.ess_threshold < 1)
    throw InputError("the Gaussian-mixture filter corrects at every step", "ess-threshold",
                     fmt::format("{}", options.ess_threshold));
  if (options.alpha && !(*options.alpha >= 0 && *options.alpha <= 1))
    throw InputError("must lie between 0 and 1", "alpha", fmt::format("{}", *options.alpha));
  if (!(options.beta >= 0 && std::isfinite(options.beta)))
    throw InputError("must be a number of at least 0", "beta", fmt::format("{}", options.beta));
}

void check_family_options(const Model& model, const FilterOptions& options) {
  check_tree_options(model, options);
  if (model.reported_dimension() != 1)
    throw InputError("families are conditioned in one dimension", "conditioning",
                     fmt::format("{} states", model.reported_dimension()));
  if (model.observation == ObservationKind::continuous)
    throw InputError("families are conditioned on discrete observations", "conditioning", "families");
  if (options.thinning.method == ThinningMethod::none)
    throw InputError("families are thinned between observations", "thin", "none");
  if (options.prune_weights != PruneWeights::likelihood)
    throw InputError("likelihoods always decide about conditioned families", "prune-weights", "cubature");
  if (options.ess_threshold < 1)
    throw InputError("likelihoods decide about conditioned families at every step", "ess-threshold",
                     fmt::format("{}", options.ess_threshold));
  if (!(options.substep_tolerance > 0))
    throw InputError("must be positive", "substep tolerance", fmt::format("{}", options.substep_tolerance));
}

}  // namespace

std::unique_ptr<Functional> make_functional(const FilterOptions& options) {
  return options.own_functional ? options.own_functional() : make_functional(options.functional);
}

void exchange(StateArchive& archive, LikelihoodRatio& ratio) {
  archive(ratio.log_mean, ratio.log_variance, ratio.effective_size);
}

void exchange(StateArchive& archive, FilterStatistics& s) {
  archive(s.flow.node_segments, s.flow.field_evaluations, s.flow.cvode_nodes, s.steps, s.children,
          s.dropped_nodes, s.conditioned, s.discarded);
}

void exchange(StateArchive& archive, FilterWarning& warning) {
  archive(warning.kind, warning.time, warning.text);
}

void Filter::exchange(StateArchive& archive) {
  archive(statistics_, warnings_);
  exchange_state(archive);
}

std::unique_ptr<Filter> make_filter(const Model& model, const FilterOptions& options) {
  check(model);
  refuse_oversized_filter(model, options);
  switch (options.method) {
    case FilterMethod::benes:
      return std::make_unique<BenesFilter>(model);
    case FilterMethod::kalman_bucy:
      return std::make_unique<KalmanBucyFilter>(model);
    case FilterMethod::kalman:
      return std::make_unique<KalmanFilter>(model);
    case FilterMethod::grid:
      return std::make_unique<GridFilter>(model, options);
    case FilterMethod::klv:
      if (options.conditioning == Conditioning::components) {
        check_component_options(model, options);
        return std::make_unique<ComponentFilter>(model, options);
      }
      if (options.conditioning == Conditioning::families) {
        check_family_options(model, options);
        return std::make_unique<FamilyFilter>(model, options);
      }
      check_tree_options(model, options);
      return std::make_unique<KlvFilter>(model, options);
    case FilterMethod::euler:
      check_particle_options(options);
      return std::make_unique<EulerFilter>(model, options);
    case FilterMethod::gaussian_mixture:
      check_mixture_options(options);
      return std::make_unique<GaussianMixtureFilter>(model, options);
    case FilterMethod::weighted:
      check_node_options(options);
      return std::make_unique<WeightedFilter>(model, options);
    case FilterMethod::full_tree: {
      check_tree_options(model, options);
      FilterOptions unpruned = options;
      unpruned.thinning.method = ThinningMethod::none;
      return std::make_unique<KlvFilter>(model, unpruned);
    }
  }
  throw InputError("unknown filter", "method");
}

void refuse_oversized_tree(const Model& model, const FilterOptions& options, std::size_t steps) {
  if (options.method == FilterMethod::full_tree ||
      (options.method == FilterMethod::klv && options.thinning.method == ThinningMethod::none))
    refuse_oversized_tree(options.formula, model, steps, options.memory_limit);
}

void run(Filter& filter, const ObservationWindows& windows,
         const std::function<void(const Posterior&)>& observe) {
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, window);
    filter.advance(window);
    if (observe) observe(filter.posterior());
  }
}

}  // namespace wienertree
