#pragma once
/// The options of filters on the command line, and the library's options they stand for.
#include <cstdint>
#include <optional>
#include <string>

#include "command_line.hpp"
#include "table.hpp"
#include "wienertree/run/controlled_filter.hpp"
#include "wienertree/run/recommended_options.hpp"

namespace wienertree::app {

/// What was given on the command line; nothing else.
struct FilterArguments : GivenOptions {
  std::optional<std::string> formula_name;  ///< a bundled name or a file, in place of `formula`
};

/// How the tree grows, is weighted and thinned.
void add_tree_options(CLI::App& app, FilterArguments& arguments);
/// Those, and the ones of other filters.
void add_filter_options(CLI::App& app, FilterArguments& arguments);

/// Into how many steps a record is cut, and the moments that are reported.
void add_record_steps(CLI::App& app, std::optional<std::uint64_t>& steps);
void add_moments(CLI::App& app, std::optional<std::uint64_t>& moments);

/// How exact the answer is to be.
struct AccuracyArguments {
  std::optional<double> tolerance, work;
  bool errors = false;
};
void add_accuracy_options(CLI::App& app, AccuracyArguments& arguments);
/// What the library's control goes by.
ControlOptions control_options(const AccuracyArguments& accuracy, const FilterArguments& filter,
                               std::optional<std::uint64_t> steps, std::optional<std::uint64_t> moments);

/// Loads the formula; what was not given is as recommended_options says.
/// @throws InputError for an option that does not apply to the method, the model or another option, and when
/// there is no formula of the degree
FilterSetup filter_setup(const FilterArguments& arguments, const Model& model);

/// The steps to cut a record into: those given, or one a gap where the filter chooses its own, or nothing.
std::optional<std::size_t> steps_in_force(const FilterSetup& setup, std::optional<std::uint64_t> given);

std::string method_name(FilterMethod method);

/// Names and values of all options in force.
Json options_in_force(const FilterSetup& setup, const Model& model);

/// "KLV filter, degree 5, 60 nodes by recombination": for titles and summaries.
std::string describe(const FilterSetup& setup);

}  // namespace wienertree::app
