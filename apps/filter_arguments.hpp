#pragma once
/// The options of filters on the command line, and the library's options they stand for.
#include <cstdint>
#include <optional>
#include <string>

#include "command_line.hpp"
#include "table.hpp"
#include "wienertree/filter/filter.hpp"

namespace wienertree::app {

/// What was given on the command line; nothing else.
struct FilterArguments {
  std::optional<FilterMethod> method;
  std::optional<std::uint64_t> degree, nodes, seed, launches, threads, recombination_degree;
  std::optional<std::string> formula;
  std::optional<ThinningMethod> thin;
  std::optional<SiteOrder> order;
  std::optional<PruneWeights> prune_weights;
  std::optional<FunctionalMethod> functional;
  std::optional<FlowMethod> flow;
  std::optional<double> relative_tolerance, absolute_tolerance, ess_threshold, alpha, beta;
  std::optional<OnNodeFailure> on_node_failure;
};

/// How the tree grows, is weighted and thinned.
void add_tree_options(CLI::App& app, FilterArguments& arguments);
/// Those, and the ones of other filters.
void add_filter_options(CLI::App& app, FilterArguments& arguments);

/// Into how many steps a record is cut, and the moments that are reported.
void add_record_steps(CLI::App& app, std::optional<std::uint64_t>& steps);
void add_moments(CLI::App& app, std::optional<std::uint64_t>& moments);

/// What will be run.
struct FilterSetup {
  FilterOptions options;
  std::uint32_t launches = 1;
  bool random = false;  ///< whether a seed changes the result
};

/// Fills in the defaults and loads the formula.
/// @throws InputError for an option that does not apply to the method, the model or another option, and when
/// there is no formula of the degree
FilterSetup filter_setup(const FilterArguments& arguments, const Model& model);

/// The filter that solves this model exactly, if one is known to.
std::optional<FilterMethod> exact_method(const Model& model);
std::string method_name(FilterMethod method);
/// Whether a filter moves weighted nodes, rather than a density in closed form or on a grid.
bool keeps_nodes(FilterMethod method);

/// Names and values of all options in force.
Json options_in_force(const FilterSetup& setup, const Model& model);

/// "KLV filter, degree 5, 60 nodes by recombination": for titles and summaries.
std::string describe(const FilterSetup& setup);

}  // namespace wienertree::app
