#include "command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <new>

#include "interruption.hpp"
#include "output.hpp"
#include "run_files.hpp"
#include "wienertree/model/text/location.hpp"
#include "wienertree/model/text/printable.hpp"
#include "wienertree/numeric/memory.hpp"

namespace wienertree::app {
namespace {

// The whole text as a number, in any locale.
template <class Number>
bool parse_whole(const std::string& text, Number& number) {
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  return status == std::errc() && end == text.data() + text.size();
}

}  // namespace

double finite_number(const std::string& option, const std::string& text) {
  double number = 0;
  if (!parse_whole(text, number)) throw InputError("must be a number", option, text);
  if (!std::isfinite(number)) throw InputError("must be a finite number", option, text);
  return number;
}

namespace {

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> subcommand_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  return names;
}

// The innermost subcommand that was reached, and its name as it was typed: "formulas show".
struct Reached {
  const CLI::App* app;
  std::string name;
};

Reached innermost(const CLI::App& app) {
  Reached reached{&app, {}};
  while (!reached.app->get_subcommands().empty()) {
    reached.app = reached.app->get_subcommands().back();
    reached.name += (reached.name.empty() ? "" : " ") + reached.app->get_name();
  }
  return reached;
}

// The name of an argument that nothing takes: a misspelt option, a misspelt subcommand or a stray word.
InputError unknown_argument(const CLI::App& app, const Reached& reached) {
  const std::vector<std::string> rest = app.remaining(true);
  std::string argument = rest.empty() ? "" : rest.front();
  if (argument.starts_with("-")) {
    argument = argument.substr(0, argument.find('='));
    return {"unknown option" + text::suggestion(argument, option_names(*reached.app)), reached.name,
            argument};
  }
  const std::vector<std::string> subcommands = subcommand_names(*reached.app);
  if (!subcommands.empty())
    return {"unknown subcommand" + text::suggestion(argument, subcommands), reached.name, argument};
  return {"one argument too many", reached.name, argument};
}

InputError missing_argument(const CLI::ParseError& error, const Reached& reached) {
  const std::vector<std::string> subcommands = subcommand_names(*reached.app);
  if (!subcommands.empty() && reached.app->get_subcommands().empty())
    return {fmt::format("a subcommand is needed: {}", fmt::join(subcommands, ", ")), reached.name};
  return {error.what(), reached.name};
}

InputError usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const Reached reached = innermost(app);
  // An unknown word may also keep a required argument from being seen: it is the better thing to name.
  if (!app.remaining(true).empty()) return unknown_argument(app, reached);
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) return missing_argument(error, reached);
  return {error.what(), reached.name};
}

// The library names an option as its field is called; here it is called as it is typed.
InputError with_option_spelled(const InputError& error, const CLI::App& app) {
  const bool option = !error.where().empty() && app.get_option_no_throw("--" + error.where()) != nullptr;
  return option ? InputError(error.message(), "--" + error.where(), error.value()) : error;
}

int complain(const std::string& message, int code) {
  tell(text::printable("wienertree: " + message) + '\n');
  return code;
}

}  // namespace

CLI::Option* add_count(CLI::App& app, const std::string& name, std::optional<std::uint64_t>& target,
                       std::uint64_t least, const std::string& help, std::uint64_t most) {
  const auto parse = [&target, name, least, most](const std::string& text) {
    std::uint64_t number = 0;
    if (!parse_whole(text, number))
      throw InputError(fmt::format("must be a whole number of at least {}", least), name, text);
    if (number < least) throw InputError(fmt::format("must be at least {}", least), name, text);
    if (number > most) throw InputError(fmt::format("must be at most {}", most), name, text);
    target = number;
  };
  return app.add_option_function<std::string>(name, parse, help)->type_name("N");
}

CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& target, Sign sign,
                        const std::string& help) {
  const auto parse = [&target, name, sign](const std::string& text) {
    const double number = finite_number(name, text);
    if (sign == Sign::positive && !(number > 0)) throw InputError("must be positive", name, text);
    target = number;
  };
  return app.add_option_function<std::string>(name, parse, help)->type_name("X");
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& target,
                      const std::string& type, const std::string& help) {
  return app
      .add_option_function<std::string>(
          name,
          [&target, name, type](const std::string& text) {
            const bool file = type.find("FILE") != std::string::npos || type == "DIR";
            if (file && text.empty())
              throw InputError("a file name is needed, and this one is empty", name.substr(0, name.find(',')),
                               "''");
            target = text;
          },
          help)
      ->type_name(type);
}

std::size_t choose(const std::string& option, const std::string& value,
                   const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == value) return i;
  throw InputError(fmt::format("must be one of {}{}", fmt::join(names, ", "), text::suggestion(value, names)),
                   option, value);
}

std::pair<std::string, double> parse_assignment(const std::string& text, const std::string& option) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw InputError("must be NAME=VALUE", option, text);
  const std::string name = text.substr(0, equals);
  return {name, finite_number(option + " " + name, text.substr(equals + 1))};
}

void add_assignments(CLI::App& app, Assignments& target) {
  const auto parse = [&target](const std::vector<std::string>& assignments) {
    for (const std::string& assignment : assignments) target.push_back(parse_assignment(assignment, "--set"));
  };
  app.add_option_function<std::vector<std::string>>("--set", parse,
                                                    "Set a parameter of the model; may be repeated")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_memory_limit(CLI::App& app) {
  app.add_option_function<std::string>(
         "--memory", [](const std::string& text) { set_memory_limit(finite_number("--memory", text)); },
         "Limit of the memory that may be taken [three quarters of what the machine has free]")
      ->type_name("BYTES");
}

void set_option(CLI::App& app, const std::string& name, const std::vector<std::string>& values) {
  CLI::Option* option = app.get_option_no_throw(name);
  if (option == nullptr)
    throw InputError("unknown option" + text::suggestion(name, option_names(app)), app.get_name(), name);
  for (const std::string& value : values) option->add_result(value);
  try {
    option->run_callback();
  } catch (const CLI::ParseError& error) {
    throw InputError(error.what(), name);
  }
}

void parse_words(CLI::App& app, std::vector<std::string> words) {
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    throw usage_error(app, error);
  }
}

int run_program(CLI::App& app, int argc, char** argv) {
  const RunFiles files;
  try {
    try {
      app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
      write_to_stdout(innermost(app).app->help());
    } catch (const CLI::Success& version) {
      write_to_stdout(std::string(version.what()) + "\n");
    } catch (const CLI::ParseError& error) {
      throw usage_error(app, error);
    }
    return 0;
  } catch (const BrokenPipe&) {
    return 1;
  } catch (const Interrupted& interrupted) {
    complain(interrupted.what(), 1);
    end_by(interrupted.signal());
    return 1;
  } catch (const SaidAlready& said) {
    return said.exit_code;
  } catch (const InputError& error) {
    return complain(with_option_spelled(error, *innermost(app).app).what(), 2);
  } catch (const Error& error) {
    return complain(error.what(), 1);
  } catch (const std::bad_alloc&) {
    return complain("out of memory: fewer nodes (--nodes) or threads need less", 1);
  } catch (const std::exception& error) {
    return complain(std::string("unexpected failure: ") + error.what(), 1);
  }
}

}  // namespace wienertree::app
