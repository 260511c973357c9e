#include <fmt/format.h>

#include "file_format.hpp"
#include "pages.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {
namespace {

// Text as troff takes it: no hyphen for a minus, no line that looks like a request.
std::string troff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    if (c == '-')
      out += "\\-";
    else if (c == '\\')
      out += "\\e";
    else
      out += c;
  }
  return out;
}

std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_single_name() : "--" + option.get_lnames().front();
}

bool takes_value(const CLI::Option& option) {
  return !option.get_lnames().empty() && option.get_items_expected_max() > 0;
}

std::string paragraph(const CLI::Option& option) {
  std::string head = "\\fB" + troff(name_of(option)) + "\\fR";
  if (takes_value(option)) head += " \\fI" + troff(option.get_type_name()) + "\\fR";
  return ".TP\n" + head + "\n" + troff(option.get_description()) +
         (option.get_required() ? " (required)" : "") + ".\n";
}

std::string synopsis(const CommandPath& command) {
  std::string line = ".B wienertree " + troff(command.name()) + "\n";
  for (const CLI::Option* option : options_of(*command.app)) {
    const bool positional = option->get_lnames().empty();
    if (!positional && !option->get_required()) continue;
    if (!positional) line += ".B " + troff(name_of(*option)) + "\n";
    line += ".I " + troff(positional ? option->get_single_name() : option->get_type_name()) + "\n";
  }
  return line + "[\\fIOPTIONS\\fR]\n.br\n";
}

// The footer's examples keep their lines.
std::string section(const CommandPath& command) {
  std::string text =
      fmt::format(".SS {}\n{}.\n", troff(command.name()), troff(command.app->get_description()));
  for (const CLI::Option* option : options_of(*command.app)) text += paragraph(*option);
  const std::string footer = command.app->get_footer();
  if (!footer.empty()) text += ".PP\n.nf\n" + troff(footer) + "\n.fi\n";
  return text;
}

constexpr const char* opening = R"(.SH DESCRIPTION
Cubature on Wiener space: the law of a nonlinear signal given its observations, and averages of stochastic differential
equations, by a tree of nodes that is thinned as it grows.
.PP
A \fIMODEL\fR is the name of a bundled one (\fBwienertree model list\fR) or a TOML file: what contains a slash or ends in
\&.toml is a file.
Defaults stand in brackets.
The same seed gives the same bytes, for any number of threads.
.SH COMMANDS
)";

constexpr const char* closing = R"(.SH FILES
.TP
.I share/wienertree/models
Bundled models
.TP
.I share/wienertree/cubature_formulas
Bundled cubature formulas
.TP
.I share/wienertree/observations
Example observations
.SH ENVIRONMENT
.TP
.B WIENERTREE_DATA
The directory of the bundled models and formulas, if not the installed one
.SH EXIT STATUS
.TP
.B 0
done
.TP
.B 1
the run failed; the message says at which step, time and node
.TP
.B 2
wrong usage or bad input; the message says where, and which value
.SH SEE ALSO
.BR gnuplot (1)
)";

}  // namespace

std::string CommandPath::name() const { return fmt::format("{}", fmt::join(words, " ")); }

std::vector<CommandPath> all_commands(const CLI::App& program) {
  std::vector<CommandPath> all;
  for (const CLI::App* sub : program.get_subcommands([](const CLI::App*) { return true; })) {
    all.push_back({{sub->get_name()}, sub});
    for (CommandPath inner : all_commands(*sub)) {
      inner.words.insert(inner.words.begin(), sub->get_name());
      all.push_back(std::move(inner));
    }
  }
  return all;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  std::vector<const CLI::Option*> all;
  for (const CLI::Option* option : app.get_options())
    if (option != app.get_help_ptr()) all.push_back(option);
  return all;
}

std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.find('|') == std::string::npos ||
      type.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ=") != std::string::npos)
    return {};
  return CLI::detail::split(type, '|');
}

std::string manual_page(const CLI::App& program) {
  std::string text = fmt::format(
      ".TH WIENERTREE 1 \"\" \"wienertree {}\" \"User Commands\"\n.SH NAME\nwienertree \\- {}\n.SH "
      "SYNOPSIS\n",
      version, troff(program.get_description()));
  const std::vector<CommandPath> commands = all_commands(program);
  for (const CommandPath& command : commands)
    if (all_commands(*command.app).empty()) text += synopsis(command);
  text += ".B wienertree\n\\-\\-help | \\-\\-version\n.PP\nEvery command has its own \\fB\\-\\-help\\fR.\n";
  text += opening;
  for (const CommandPath& command : commands)
    if (all_commands(*command.app).empty()) text += section(command);
  text += ".SH FILE FORMATS\n";
  for (const FileFormat& format : file_formats())
    text += fmt::format(".SS The file: {}\n.nf\n{}\n.fi\n", format.name, troff(format_text(format)));
  return text + closing;
}

}  // namespace wienertree::app
