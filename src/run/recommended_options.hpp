#pragma once
/// The options of a filter: what the user gives, and for everything else what is recommended for the model. The
/// program, Python and C++ all have their defaults from here.
#include <cstdint>
#include <filesystem>
#include <optional>

#include "wienertree/filter/filter.hpp"

namespace wienertree {

/// What was given; nothing else.
struct GivenOptions {
  std::optional<FilterMethod> method;
  std::optional<std::uint64_t> degree, nodes, seed, launches, threads, recombination_degree;
  std::optional<CubatureFormula> formula;
  std::optional<ThinningMethod> thin;
  std::optional<SiteOrder> order;
  std::optional<PruneWeights> prune_weights;
  std::optional<FunctionalMethod> functional;
  std::optional<Conditioning> conditioning;
  std::optional<FlowMethod> flow;
  std::optional<double> relative_tolerance, absolute_tolerance, ess_threshold, alpha, beta;
  std::optional<OnNodeFailure> on_node_failure;
};

/// What will be run.
struct FilterSetup {
  FilterOptions options;
  std::uint32_t launches = 1;
  bool random = false;  ///< whether a seed changes the result
};

/// The filter that solves this model exactly, if its coefficients were verified to be of that kind.
std::optional<FilterMethod> exact_method(const Model& model);
/// Whether a filter moves weighted nodes, rather than a density in closed form or on a grid.
bool keeps_nodes(FilterMethod method);
/// Whether a filter moves particles by random numbers.
bool moves_particles(FilterMethod method);

/// The method without further options: the exact filter where the model has one and nothing was given that only
/// filters with nodes know; the KLV filter otherwise.
FilterMethod recommended_method(const Model& model, const GivenOptions& given);
/// The way to thin that the method uses unless another is given.
ThinningMethod recommended_thinning(const GivenOptions& given, FilterMethod method);

/// How the method takes in discrete observations unless a way is given: families of one state, components of several
/// where nothing is asked that only trees of nodes know.
Conditioning recommended_conditioning(const Model& model, const GivenOptions& given, FilterMethod method);

/// All options. @param formulas the directory of cubature formulas
/// @throws InputError when there is no formula of the degree
FilterSetup recommended_options(const Model& model, const GivenOptions& given,
                                const std::filesystem::path& formulas);

}  // namespace wienertree
