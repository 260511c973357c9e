#pragma once
/// The subcommands: each adds itself, its options and its help to the program.
#include <CLI/CLI.hpp>

namespace wienertree::app {

void add_simulate_command(CLI::App& program);
void add_filter_command(CLI::App& program);
void add_compare_command(CLI::App& program);
void add_formulas_command(CLI::App& program);
void add_model_command(CLI::App& program);
void add_tree_command(CLI::App& program);
void add_weak_command(CLI::App& program);
void add_study_command(CLI::App& program);
void add_format_command(CLI::App& program);

}  // namespace wienertree::app
