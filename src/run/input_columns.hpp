#pragma once
/// Known functions of time as columns of a CSV file.
#include <string>
#include <vector>

#include "wienertree/model/input_functions.hpp"

namespace wienertree {

/// The columns t and `names` of a file, in any order; others are passed over.
/// @throws InputError naming file, line and column: a column that is missing, a field that is no finite number or is
/// missing, times that do not increase, a file that cannot be read or has no rows
std::vector<InputFunction> read_input_columns(const std::string& file, const std::vector<std::string>& names);

/// Whether the header of a file has all of these. @throws InputError if it cannot be read
bool has_columns(const std::string& file, const std::vector<std::string>& names);

}  // namespace wienertree
