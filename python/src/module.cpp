/// The compiled part of the Python package `wienertree`.
#include "bindings.hpp"
#include "data_directory.hpp"
#include "wienertree/version.hpp"

PYBIND11_MODULE(_core, module) {
  using namespace wienertree::python;
  module.doc() = "The compiled part of wienertree; use `import wienertree`.";
  module.attr("__version__") = WIENERTREE_VERSION;
  module.def(
      "data_directory", [] { return wienertree::app::data_directory().string(); },
      "Where the bundled models, formulas and observations lie.");
  add_errors(module);
  add_models(module);
  add_formulas(module);
  add_filters(module);
  add_weak(module);
  add_thinning(module);
}
