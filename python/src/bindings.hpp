#pragma once
/// The parts of the module, each added by a file of its own.
#include <pybind11/pybind11.h>

namespace wienertree::python {

void add_errors(pybind11::module_& module);
void add_models(pybind11::module_& module);
void add_formulas(pybind11::module_& module);
void add_filters(pybind11::module_& module);
void add_weak(pybind11::module_& module);
void add_thinning(pybind11::module_& module);

}  // namespace wienertree::python
