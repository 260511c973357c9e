#include "formulas.hpp"

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "data_directory.hpp"
#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/cubature/formula_file.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree::python {
namespace {

// A row a segment, (dw^0, .., dw^p): the columns of the library's matrix, seen as rows.
using Segments = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

CubatureFormula make_formula(const std::vector<double>& weights, const std::vector<Segments>& paths,
                             int degree, int dimension, const std::string& name, const std::string& source) {
  if (weights.size() != paths.size())
    throw InputError("as many weights are needed as paths", "Formula",
                     std::to_string(weights.size()) + " and " + std::to_string(paths.size()));
  CubatureFormula formula{name, degree, dimension, source, {}};
  for (std::size_t j = 0; j < paths.size(); ++j)
    formula.paths.push_back({weights[j], paths[j].transpose(), {}});
  check_structure(formula, name);
  return formula;
}

py::array_t<double> weights_of(const CubatureFormula& formula) {
  std::vector<double> weights;
  for (const CubaturePath& path : formula.paths) weights.push_back(path.weight);
  return hand_over(std::move(weights));
}

// Read-only arrays on the formula's own memory, which they keep alive.
py::list paths_of(const py::object& self) {
  const auto& formula = self.cast<const CubatureFormula&>();
  py::list paths;
  for (const CubaturePath& path : formula.paths) {
    py::array_t<double> segments({path.increments.cols(), path.increments.rows()}, path.increments.data(),
                                 self);
    segments.attr("flags").attr("writeable") = false;
    paths.append(std::move(segments));
  }
  return paths;
}

py::object verification_of(const CubatureFormula& formula, double tolerance) {
  const FormulaVerification v = [&] {
    const py::gil_scoped_release unlocked;
    return verify(formula, tolerance);
  }();
  py::object failure = py::none();
  if (v.first_failure)
    failure = py::make_tuple(v.first_failure->word, v.first_failure->value, v.first_failure->expected);
  return py::module_::import("wienertree.results")
      .attr("Verification")(v.holds(), v.stated_degree, v.degree, v.max_error, v.next_residual, failure,
                            v.brief());
}

std::string shown(const CubatureFormula& formula) {
  return "<wienertree.Formula " + formula.name + ": degree " + std::to_string(formula.degree) +
         ", dimension " + std::to_string(formula.dimension) + ", " + std::to_string(formula.paths.size()) +
         " paths>";
}

}  // namespace

std::optional<CubatureFormula> take_formula(py::dict& options) {
  if (!options.contains("formula") || !py::isinstance<CubatureFormula>(options["formula"])) return {};
  const CubatureFormula formula = options["formula"].cast<CubatureFormula>();
  options.attr("pop")("formula");
  return formula;
}

void require_usable(const CubatureFormula& formula, std::size_t noise_dimension) {
  require_holds(verify(formula, moment_tolerance, false), "formula " + formula.name);
  if (formula.dimension != static_cast<int>(noise_dimension))
    throw InputError("is for " + std::to_string(formula.dimension) + " Brownian motions, the model has " +
                         std::to_string(noise_dimension),
                     "--formula", formula.name);
}

void add_formulas(py::module_& module) {
  using namespace py::literals;
  py::class_<CubatureFormula>(module, "Formula", R"(A cubature formula on Wiener space: weights and paths.

Formula(weights, paths, degree=m, dimension=p) is one of your own: a path is an array (segments, 1+p), each row
the increments (dw^0, dw^1, .., dw^p) of one segment. Nothing is trusted: verify() compares all moments, and
a filter refuses a formula whose moments do not hold.)")
      .def(py::init(&make_formula), "weights"_a, "paths"_a, py::kw_only(), "degree"_a, "dimension"_a,
           "name"_a = "unnamed", "source"_a = "")
      .def_static(
          "load", [](const std::string& name) { return load_formula(app::formula_path(name, "formula")); },
          "name"_a, "A bundled formula by its name, or a JSON file; its moments are verified.")
      .def_readonly("name", &CubatureFormula::name)
      .def_readonly("degree", &CubatureFormula::degree, "m: moments hold up to this degree.")
      .def_readonly("dimension", &CubatureFormula::dimension, "p: number of Brownian motions.")
      .def_readonly("source", &CubatureFormula::source, "Where it was published.")
      .def_property_readonly("weights", &weights_of, "One a path.")
      .def_property_readonly("paths", &paths_of,
                             "Arrays (segments, 1+p) of increments, read-only and not copied.")
      .def("verify", &verification_of, "tolerance"_a = moment_tolerance,
           "Compares all moments with those of Brownian motion, word by word. Returns a Verification.")
      .def(
          "save",
          [](const CubatureFormula& formula, const std::string& file) { save_formula(formula, file); },
          "file"_a, "Writes a JSON file, which appears whole or not at all.")
      .def("__len__", [](const CubatureFormula& formula) { return formula.paths.size(); })
      .def("__repr__", &shown);

  module.def(
      "construct", [](int degree, int dimension) { return construct(degree, dimension); }, "degree"_a,
      "dimension"_a, py::call_guard<py::gil_scoped_release>(),
      "The formula of this degree in closed form: degree 3, any dimension; degree 5, up to 16.");
  module.def(
      "formulas", [] { return app::bundled_names("cubature_formulas", ".json"); },
      "Names of the bundled formulas.");
  module.def(
      "find_formula",
      [](int degree, int dimension) { return find_formula(degree, dimension, app::formulas_directory()); },
      "degree"_a, "dimension"_a,
      "The formula of this degree and dimension that promises the least error for a given amount of work.");
}

}  // namespace wienertree::python
