#pragma once
/// The true signal as a CSV file: header `t,<state>..`, one row a time.
#include <string>

#include "table.hpp"
#include "wienertree/filter/observations.hpp"

namespace wienertree::app {

Table signal_table(const Model& model, const ObservationPath& signal);

/// @throws InputError for a file that cannot be read or has other columns than t and the model's states
ObservationPath read_signal(const std::string& file, const Model& model);

}  // namespace wienertree::app
