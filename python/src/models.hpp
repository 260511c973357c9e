#pragma once
/// Models as Python holds them.
#include <pybind11/pybind11.h>

#include <string>

#include "command_line.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::python {

/// A model with what it was made from.
class PyModel {
 public:
  /// source: the name of a bundled model, a path, the text of a model file (it has more than one line), a
  /// dict of the same structure, or another model.
  /// @throws InputError as TextModel::load and TextModel::parse
  static PyModel make(const pybind11::handle& source, const app::Assignments& set = {});

  const TextModel& text() const { return text_; }
  const Model& model() const { return text_.model(); }
  const app::Assignments& set() const { return set_; }
  const std::string& source() const { return source_; }
  /// Those that are known.
  const std::vector<InputFunction>& inputs() const { return inputs_; }
  /// The same model with these functions of time. @throws InputError as TextModel::with_inputs
  PyModel with_inputs(std::vector<InputFunction> inputs) const;

 private:
  PyModel(TextModel text, std::string source, app::Assignments set)
      : text_(std::move(text)), source_(std::move(source)), set_(std::move(set)) {}

  TextModel text_;
  std::string source_;
  app::Assignments set_;
  std::vector<InputFunction> inputs_;
};

/// {"kappa": 1.5}, or nothing for None. @throws pybind11::cast_error
app::Assignments assignments_of(const pybind11::object& set);

}  // namespace wienertree::python
