#include "input_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "run_files.hpp"
#include "wienertree/run/input_columns.hpp"

namespace wienertree::app {
namespace {

std::vector<std::string> names_of(const Model& model) {
  std::vector<std::string> names;
  for (const InputFunction& f : model.inputs->functions()) names.push_back(f.name);
  return names;
}

}  // namespace

void add_inputs(CLI::App& app, std::optional<std::string>& inputs) {
  add_text(app, "--inputs", inputs, "FILE",
           "CSV with header t,NAME,..: the known functions of time of the model's [inputs]");
}

TextModel with_inputs(const TextModel& model, const std::optional<std::string>& inputs,
                      const std::optional<std::string>& observations) {
  if (!model.model().inputs) {
    if (inputs) throw InputError("the model has no [inputs]", "--inputs", *inputs);
    return model;
  }
  const std::vector<std::string> names = names_of(model.model());
  if (inputs) {
    note_input("--inputs", *inputs);
    return model.with_inputs(read_input_columns(*inputs, names), *inputs);
  }
  const std::string needed =
      fmt::format("the model depends on inputs: give a CSV file t,{}", fmt::join(names, ","));
  if (!observations) throw InputError(needed, "--inputs");
  if (*observations == "-")
    throw InputError(needed + "; rows that come one by one bring no inputs", "--inputs");
  note_input("--observations", *observations);
  if (!has_columns(*observations, names))
    throw InputError(needed + ", or these columns among the observations", *observations);
  return model.with_inputs(read_input_columns(*observations, names), *observations);
}

void refuse_inputs(const Model& model, const std::string& what) {
  if (!model.inputs) return;
  throw InputError(fmt::format("depends on the input {}, and {} has no file for inputs",
                               model.inputs->functions().front().name, what),
                   "model " + model.name);
}

}  // namespace wienertree::app
