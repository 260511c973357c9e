#include <fmt/format.h>

#include <map>
#include <set>

#include "pages.hpp"

namespace wienertree::app {
namespace {

std::string long_names(const CLI::App& app) {
  std::string names = "--help";
  for (const CLI::Option* option : options_of(app))
    for (const std::string& name : option->get_lnames()) names += " --" + name;
  return names;
}

std::string subcommand_names(const CLI::App& app) {
  std::string names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    names += (names.empty() ? "" : " ") + sub->get_name();
  return names;
}

enum class Kind { words, file, formula, model, other };

// What is completed where a value is expected.
Kind kind_of(const CLI::Option& option) {
  const std::string type = option.get_lnames().empty() ? option.get_single_name() : option.get_type_name();
  if (!choices_of(option).empty()) return Kind::words;
  if (type.find("MODEL") != std::string::npos) return Kind::model;
  if (type == "NAME" || type == "NAME|FILE") return Kind::formula;
  if (type.find("FILE") != std::string::npos) return Kind::file;
  return Kind::other;
}

// The same option means the same in every subcommand, but for what its value is: the case is one a command.
std::string bash_values(const CommandPath& command) {
  std::string text;
  for (const CLI::Option* option : options_of(*command.app)) {
    if (option->get_lnames().empty() || option->get_items_expected_max() == 0) continue;
    const std::string pattern = "      --" + option->get_lnames().front() + ") ";
    switch (kind_of(*option)) {
      case Kind::words:
        text += pattern + fmt::format("words=\"{}\" ;;\n", fmt::join(choices_of(*option), " "));
        break;
      case Kind::formula:
        text += pattern +
                "words=$(\"$program\" formulas list 2>/dev/null | awk 'NR > 1 { print $1 }'); files=yes ;;\n";
        break;
      case Kind::file:
        text += pattern + "files=yes ;;\n";
        break;
      case Kind::model:
      case Kind::other:
        text += pattern + "return ;;\n";
        break;
    }
  }
  return text;
}

std::string bash_positional(const CommandPath& command) {
  for (const CLI::Option* option : options_of(*command.app)) {
    if (!option->get_lnames().empty()) continue;
    switch (kind_of(*option)) {
      case Kind::words:
        return fmt::format("words=\"{}\"", fmt::join(choices_of(*option), " "));
      case Kind::model:
        return "words=$(\"$program\" model list 2>/dev/null | awk 'NR > 1 { print $1 }'); files=yes";
      case Kind::formula:
        return "words=$(\"$program\" formulas list 2>/dev/null | awk 'NR > 1 { print $1 }'); files=yes";
      default:
        return "files=yes";
    }
  }
  return "words=\"" + subcommand_names(*command.app) + "\"";
}

constexpr const char* bash_opening = R"(# Completion of wienertree(1).
_wienertree() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} program=${COMP_WORDS[0]}
  local command= words= files= word i
  # The command is what its leading words say; options and their values come after.
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    [[ $word == -* ]] && break
    case "$command${command:+ }$word" in
)";

constexpr const char* bash_closing = R"(  esac
  if [[ $cur == -* ]]; then words=$options; files=; fi
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  if [[ -n $files ]]; then
    compopt -o filenames 2>/dev/null
    COMPREPLY+=($(compgen -f -- "$cur"))
  fi
}
)";

std::string bash_function(const CLI::App& program) {
  const std::vector<CommandPath> commands = all_commands(program);
  std::string text = bash_opening, names;
  for (const CommandPath& command : commands)
    names += (names.empty() ? "" : "|") + ("\"" + command.name() + "\"");
  text += "      " + names +
          ") command=\"$command${command:+ }$word\" ;;\n      *) break ;;\n    esac\n  done\n  local "
          "options=\n  case $command in\n";
  text +=
      "    \"\") options=\"" + long_names(program) + "\"; words=\"" + subcommand_names(program) + "\" ;;\n";
  for (const CommandPath& command : commands)
    text += fmt::format(
        "    \"{}\")\n      options=\"{}\"\n      case $prev in\n{}      *) {} ;;\n      esac ;;\n",
        command.name(), long_names(*command.app), bash_values(command), bash_positional(command));
  return text + bash_closing;
}

std::string fish_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "\\'" : c == '\\' ? "\\\\" : std::string(1, c);
  return out + "'";
}

}  // namespace

std::string bash_completion(const CLI::App& program) {
  return bash_function(program) + "complete -F _wienertree wienertree\n";
}

std::string zsh_completion(const CLI::App& program) {
  return "#compdef wienertree\n# The completion of bash, by zsh's own layer for such.\nautoload -Uz "
         "bashcompinit && bashcompinit\n" +
         bash_function(program) + "complete -F _wienertree wienertree\n";
}

std::string fish_completion(const CLI::App& program) {
  std::string text =
      "# Completion of wienertree(1).\ncomplete -c wienertree -n __fish_use_subcommand -f -l help -l "
      "version\n";
  for (const CommandPath& command : all_commands(program)) {
    std::string before = "__fish_use_subcommand", within;
    if (command.words.size() > 1)
      before = fmt::format("__fish_seen_subcommand_from {}; and not __fish_seen_subcommand_from {}",
                           command.words.front(), command.words.back());
    for (const std::string& word : command.words)
      within += (within.empty() ? "" : "; and ") + ("__fish_seen_subcommand_from " + word);
    text += fmt::format("complete -c wienertree -n {} -f -a {} -d {}\n", fish_quoted(before),
                        command.words.back(), fish_quoted(command.app->get_description()));
    for (const CLI::Option* option : options_of(*command.app)) {
      if (option->get_lnames().empty()) {
        const Kind kind = kind_of(*option);
        if (kind == Kind::words)
          text += fmt::format("complete -c wienertree -n {} -f -a {}\n", fish_quoted(within),
                              fish_quoted(fmt::format("{}", fmt::join(choices_of(*option), " "))));
        if (kind == Kind::model || kind == Kind::formula)
          text += fmt::format("complete -c wienertree -n {} -a {}\n", fish_quoted(within),
                              fish_quoted(fmt::format(
                                  "(wienertree {} list | string match -rv '^name ' | string split -f1 ' ')",
                                  kind == Kind::model ? "model" : "formulas")));
        continue;
      }
      text += fmt::format("complete -c wienertree -n {} -l {} -d {}", fish_quoted(within),
                          option->get_lnames().front(), fish_quoted(option->get_description()));
      if (option->get_items_expected_max() > 0) {
        const std::vector<std::string> words = choices_of(*option);
        text += words.empty() ? (kind_of(*option) == Kind::other ? " -x" : " -r")
                              : fmt::format(" -xa {}", fish_quoted(fmt::format("{}", fmt::join(words, " "))));
      }
      text += '\n';
    }
  }
  return text;
}

}  // namespace wienertree::app
