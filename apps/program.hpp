#pragma once
/// The whole program as CLI11 knows it: subcommands, options and their help.
#include "command_line.hpp"

namespace wienertree::app {

void describe_program(CLI::App& program);

}  // namespace wienertree::app
