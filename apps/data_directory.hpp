#pragma once
/// Where the bundled models and formulas lie, and what a name on the command line stands for.
#include <filesystem>
#include <string>
#include <vector>

namespace wienertree::app {

/// $WIENERTREE_DATA if set; else the source tree's data/ for a program (or a Python module) in its build
/// tree; else share/wienertree under the prefix it is installed in.
/// @throws InputError if that is not a directory
std::filesystem::path data_directory();

/// The folder of the bundled cubature formulas.
/// @param needed whether it must be there: closed forms and particles go without
/// @throws InputError if it is needed and the data directory is not there
std::filesystem::path formulas_directory(bool needed = true);

/// Names of the files with this extension in a folder of the data directory, without extension, sorted.
std::vector<std::string> bundled_names(const std::string& folder, const std::string& extension);

/// A model: a path if it contains '/' or ends in .toml, else the name of a bundled one.
/// @throws InputError for an unknown name, with the nearest bundled one
std::filesystem::path model_file(const std::string& name_or_path);

/// A study: a path if it contains '/' or ends in .toml, else the name of a bundled one.
/// @throws InputError for an unknown name, with the nearest bundled one
std::filesystem::path study_file(const std::string& name_or_path);

/// A formula: a path if it contains '/' or ends in .json, else the name of a bundled one.
/// @throws InputError for an unknown name, with the nearest bundled one. `option` names the place in the
/// message.
std::filesystem::path formula_path(const std::string& name_or_path, const std::string& option);

}  // namespace wienertree::app
