#pragma once
/// The manual page and the completions of shells, made from the program's own description of itself.
#include <string>
#include <vector>

#include "command_line.hpp"

namespace wienertree::app {

/// A subcommand as it is typed: {"formulas", "show"}.
struct CommandPath {
  std::vector<std::string> words;
  const CLI::App* app;
  std::string name() const;  ///< "formulas show"
};

/// All subcommands, those with subcommands of their own before these.
std::vector<CommandPath> all_commands(const CLI::App& program);

/// Without the option that asks for help.
std::vector<const CLI::Option*> options_of(const CLI::App& app);
/// The words that an option's value is one of, or none.
std::vector<std::string> choices_of(const CLI::Option& option);

/// wienertree(1), in the macros of man(7).
std::string manual_page(const CLI::App& program);

std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);
std::string fish_completion(const CLI::App& program);

}  // namespace wienertree::app
