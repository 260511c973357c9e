#include "options.hpp"

#include <algorithm>

namespace wienertree::python {
namespace {

namespace py = pybind11;

std::string replaced(std::string text, char from, char to) {
  std::replace(text.begin(), text.end(), from, to);
  return text;
}

// A number in the digits that read back as the same one; anything else as its text.
std::string text_of(const py::handle& value) {
  if (PyFloat_Check(value.ptr())) return py::repr(py::float_(py::cast<double>(value))).cast<std::string>();
  return py::str(value).cast<std::string>();
}

}  // namespace

void set_options(CLI::App& app, const py::dict& options) {
  for (const auto& [key, value] : options) {
    if (value.is_none()) continue;
    const std::string name = "--" + replaced(key.cast<std::string>(), '_', '-');
    std::vector<std::string> texts;
    if (py::isinstance<py::bool_>(value)) {
      // A flag that is not set, is not given.
      const CLI::Option* option = app.get_option_no_throw(name);
      if (option != nullptr && option->get_items_expected_max() == 0 && !value.cast<bool>()) continue;
      texts.push_back(value.cast<bool>() ? "true" : "false");
    } else if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
      for (const py::handle& one : value) texts.push_back(text_of(one));
      if (texts.empty()) continue;
    } else {
      texts.push_back(text_of(value));
    }
    app::set_option(app, name, texts);
  }
}

std::string options_text(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty() || option->get_lnames().front() == "help") continue;
    text += "    " + replaced(option->get_lnames().front(), '-', '_') + ": " + option->get_description();
    const std::string type = option->get_type_name();
    if (type.find('|') != std::string::npos) text += " (" + type + ")";
    text += '\n';
  }
  return text;
}

py::dict to_dict(const app::Json& json) {
  py::dict all;
  const py::object loads = py::module_::import("json").attr("loads");
  for (const auto& [name, value] : json.items()) all[py::str(replaced(name, '-', '_'))] = loads(value.dump());
  return all;
}

}  // namespace wienertree::python
