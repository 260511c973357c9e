#pragma once
/// Options of the command line, with errors that name the option, the value and the nearest thing that would
/// have been right.
///
/// Every option that may be left out is a std::optional: what was not given keeps no value, so that defaults
/// can depend on the data and an option that does not apply can be refused.
#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree::app {

/// A whole number in [least, most]. @throws InputError when parsed (the same for those below)
CLI::Option* add_count(CLI::App& app, const std::string& name, std::optional<std::uint64_t>& target,
                       std::uint64_t least, const std::string& help,
                       std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
/// The whole text as a number. @throws InputError naming the option unless it is one, and finite
double finite_number(const std::string& option, const std::string& text);
enum class Sign { any, positive };
/// A finite number.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& target, Sign sign,
                        const std::string& help);
CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& target,
                      const std::string& type, const std::string& help);

template <class E>
struct Choice {
  std::string_view name;
  E value;
};
template <class E>
using Choices = std::vector<Choice<E>>;

/// @throws InputError that suggests the nearest of `names`
std::size_t choose(const std::string& option, const std::string& value,
                   const std::vector<std::string>& names);

template <class E>
std::vector<std::string> names_of(const Choices<E>& choices) {
  std::vector<std::string> names;
  for (const Choice<E>& choice : choices) names.emplace_back(choice.name);
  return names;
}

template <class E>
std::string name_of(const Choices<E>& choices, E value) {
  for (const Choice<E>& choice : choices)
    if (choice.value == value) return std::string(choice.name);
  return {};
}

/// One of a few words. `choices` must outlive the parsing.
template <class E>
CLI::Option* add_choice(CLI::App& app, const std::string& name, std::optional<E>& target,
                        const Choices<E>& choices, const std::string& help) {
  return app
      .add_option_function<std::string>(
          name,
          [&target, &choices, name](const std::string& value) {
            target = choices[choose(name, value, names_of(choices))].value;
          },
          help)
      ->type_name(CLI::detail::join(names_of(choices), "|"));
}

/// `--set NAME=VALUE`, repeatable.
using Assignments = std::vector<std::pair<std::string, double>>;
/// "NAME=VALUE". @throws InputError naming `option`
std::pair<std::string, double> parse_assignment(const std::string& text, const std::string& option);
void add_assignments(CLI::App& app, Assignments& target);

/// `--memory BYTES`: sets the limit of the process, before anything is estimated.
void add_memory_limit(CLI::App& app);

/// Gives an option of `app` its values outside of any command line: every value is parsed as its text.
/// @throws InputError for an unknown option, with the nearest known one, and as the option does when parsed
void set_option(CLI::App& app, const std::string& name, const std::vector<std::string>& values);

/// Parses the words of a command line, the program's name left out.
/// @throws InputError
void parse_words(CLI::App& app, std::vector<std::string> words);

/// Ends a subcommand with an exit code when what is to be said has been said.
struct SaidAlready {
  int exit_code;
};

/// Parses and runs; what a subcommand does is done by its callback. Never throws: errors become one line on
/// standard error.
/// @returns the exit code: 0 done, 1 the run failed, 2 wrong usage or bad input
int run_program(CLI::App& app, int argc, char** argv);

}  // namespace wienertree::app
