#include <fmt/format.h>

#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "file_format.hpp"
#include "output.hpp"

namespace wienertree::app {
namespace {

std::vector<std::string> format_names() {
  std::vector<std::string> names;
  for (const FileFormat& format : file_formats()) names.push_back(format.name);
  return names;
}

std::string shown(const std::string& name, bool example) {
  const FileFormat& format = file_formats()[choose("format", name, format_names())];
  if (!example) return format_text(format);
  if (format.example.empty())
    throw InputError("there is no example: such a file is written by the program alone", "--example", name);
  return format.example;
}

}  // namespace

void add_format_command(CLI::App& program) {
  CLI::App& app = *program.add_subcommand("format", "What the files look like that the program reads");
  struct Arguments {
    std::string name;
    bool example = false;
  };
  const auto a = std::make_shared<Arguments>();
  app.add_option("FORMAT", a->name, "Of which file")
      ->required()
      ->type_name(fmt::format("{}", fmt::join(format_names(), "|")));
  app.add_flag("--example", a->example, "The example alone, as a file to begin with");
  app.footer("Example:\n  wienertree format model --example >mymodel.toml");
  app.callback([a] { write_to_stdout(shown(a->name, a->example)); });
}

}  // namespace wienertree::app
