#include "program.hpp"

#include "commands.hpp"
#include "wienertree/version.hpp"

namespace wienertree::app {

void describe_program(CLI::App& program) {
  program.name("wienertree");
  program.description("Cubature on Wiener space: nonlinear filtering by the Kusuoka-Lyons-Victoir tree");
  program.set_version_flag("--version", "wienertree " WIENERTREE_VERSION, "Print the version and exit");
  program.require_subcommand(1);
  program.footer(
      "A model is a name (wienertree model list) or a TOML file. For example:\n"
      "  wienertree simulate benes --horizon 10 --steps 10000 --seed 1 --observations Y.csv --signal X.csv\n"
      "  wienertree filter benes --observations Y.csv --signal X.csv --output posterior.csv --plot "
      "posterior.svg\n"
      "Each subcommand has its own --help.");
  add_simulate_command(program);
  add_filter_command(program);
  add_compare_command(program);
  add_weak_command(program);
  add_study_command(program);
  add_formulas_command(program);
  add_model_command(program);
  add_tree_command(program);
  add_format_command(program);
}

}  // namespace wienertree::app
