#include <fmt/format.h>
#include <pybind11/stl.h>

#include <chrono>

#include "arrays.hpp"
#include "bindings.hpp"
#include "formulas.hpp"
#include "interrupts.hpp"
#include "models.hpp"
#include "options.hpp"
#include "weak_outcome.hpp"

namespace wienertree::python {
namespace {

using namespace py::literals;

// One number of every payoff, or None where the run has no such number.
py::object numbers(const app::WeakOutcome& outcome, const std::string& name, bool one) {
  std::vector<double> values;
  for (const app::NamedNumbers& row : outcome.rows)
    for (const auto& [column, value] : row)
      if (column == name) values.push_back(value);
  if (values.empty()) return py::none();
  if (one) return py::float_(values.front());
  return hand_over(std::move(values));
}

py::object weak(const py::object& source, const py::object& payoff, py::kwargs options) {
  const py::object set =
      options.contains("set") ? py::object(options.attr("pop")("set")) : py::object(py::none());
  const PyModel model = PyModel::make(source, assignments_of(set));
  options["payoff"] = payoff;
  CLI::App app("", "weak");
  app::WeakArguments arguments;
  app::add_weak_options(app, arguments);
  if (const auto formula = take_formula(options))
    throw InputError("is given by name or file here: save it first", "--formula", formula->name);
  set_options(app, options);
  if (arguments.horizons.empty()) throw InputError("is needed", "--horizon");
  const bool one = py::isinstance<py::str>(payoff) && arguments.horizons.size() == 1;
  const auto began = std::chrono::steady_clock::now();
  const app::WeakProblem problem = app::weak_problem(arguments, model.text());
  const app::WeakOutcome o = [&] {
    const py::gil_scoped_release unlocked;
    Interrupts interrupts;
    const app::WeakObserver observer = {{}, [&] { interrupts.check(); }};
    return arguments.tolerance
               ? app::weak_to_tolerance(arguments, problem, observer)
               : app::weak_with_steps(arguments, problem, app::weak_formula(arguments, problem), 0, observer);
  }();
  if (!o.warning.empty())
    py::module_::import("warnings")
        .attr("warn")(fmt::format("tolerance {:g}: {}", *arguments.tolerance, o.warning));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  py::object split = py::none();
  if (arguments.tolerance) {
    py::dict parts;
    for (const char* part : {"discretisation", "thinning", "ode", "sampling"})
      parts[part] = numbers(o, std::string("error_") + part, one);
    split = std::move(parts);
  }
  return py::module_::import("wienertree.results")
      .attr("WeakResult")(numbers(o, "value", one), numbers(o, "standard_error", one),
                          numbers(o, "extrapolated", one), numbers(o, "extrapolated_standard_error", one),
                          numbers(o, "error", one), split, o.leaves, o.ode_solves,
                          to_dict(app::options_in_force(o.run)), took.count());
}

}  // namespace

void add_weak(py::module_& module) {
  CLI::App app;
  app::WeakArguments arguments;
  app::add_weak_options(app, arguments);
  app.remove_option(app.get_option("--payoff"));
  app.remove_option(app.get_option("--set"));
  const std::string text = R"(Averages of payoffs at the horizon: E[payoff(X_T)]. Returns a WeakResult.

model: a Model, or what makes one (a bundled name, a file, a text, a dict).
payoff: an expression of states and parameters, or a list of them.
set: values that replace parameters of the model, {"kappa": 1.5}.
horizon: a time, or several, ascending. Where a tolerance is not reached the best value is returned, with a
    UserWarning that says what limits it.

The options of the command line, under the same names:

)" + options_text(app);
  module.def("weak", &weak, "model"_a, "payoff"_a, text.c_str());
}

}  // namespace wienertree::python
