#pragma once
/// Keyword arguments as the options of the command line.
#include <pybind11/pybind11.h>

#include <string>

#include "command_line.hpp"
#include "table.hpp"

namespace wienertree::python {

/// recombination_degree=3 is --recombination-degree 3; None is as if it were not given.
/// @throws InputError as the option does, and for an unknown one with the nearest known
void set_options(CLI::App& app, const pybind11::dict& options);

/// What the options are, for a docstring: a line each.
std::string options_text(const CLI::App& app);

/// Names with underscores.
pybind11::dict to_dict(const app::Json& json);

}  // namespace wienertree::python
