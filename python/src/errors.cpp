/// The library's exceptions as those of wienertree.errors.
#include <regex>

#include "bindings.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::python {
namespace {

namespace py = pybind11;

// Options have the command line's names: "--recombination-degree" is recombination_degree here.
std::string in_python(const std::string& text) {
  static const std::regex option("(^|[ (])--([a-z][a-z-]*)");
  std::string out;
  std::size_t done = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), option), end; match != end; ++match) {
    out += text.substr(done, static_cast<std::size_t>(match->position()) - done);
    out += match->str(1);
    for (const char c : match->str(2)) out += c == '-' ? '_' : c;
    done = static_cast<std::size_t>(match->position() + match->length());
  }
  return out + text.substr(done);
}

void raise(const char* name, const Error& error) {
  const py::object type = py::module_::import("wienertree.errors").attr(name);
  PyErr_SetObject(type.ptr(),
                  type(in_python(error.message()), in_python(error.where()), error.value()).ptr());
}

}  // namespace

void add_errors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      raise("InputError", error);
    } catch (const Error& error) {
      raise("RunError", error);
    }
  });
}

}  // namespace wienertree::python
