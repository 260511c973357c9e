#pragma once
/// The option that gives a model its known functions of time.
#include <optional>
#include <string>

#include "command_line.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::app {

void add_inputs(CLI::App& app, std::optional<std::string>& inputs);

/// The model with its inputs as columns of the CSV file `inputs`, if it is given, else of the observations.
/// @throws InputError where the model has inputs and neither file gives them, or has none and `inputs` is given
TextModel with_inputs(const TextModel& model, const std::optional<std::string>& inputs,
                      const std::optional<std::string>& observations = {});

/// @throws InputError naming them, where a model has inputs, which `what` has no file for
void refuse_inputs(const Model& model, const std::string& what);

}  // namespace wienertree::app
