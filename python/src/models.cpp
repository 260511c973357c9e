#include "models.hpp"

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "data_directory.hpp"
#include "wienertree/filter/simulate.hpp"

namespace wienertree::python {
namespace {

constexpr const char* dict_origin = "dict";
constexpr const char* text_origin = "text";

bool is_text(const std::string& source) { return source.find('\n') != std::string::npos; }

TextModel parse_or_load(const std::string& source, const char* origin, const app::Assignments& set) {
  return is_text(source) ? TextModel::parse(source, origin, set)
                         : TextModel::load(app::model_file(source).string(), set);
}

std::string observation_kind(const Model& model) {
  switch (model.observation) {
    case ObservationKind::none:
      return "none";
    case ObservationKind::continuous:
      return "continuous";
    case ObservationKind::discrete:
      return "discrete";
  }
  return {};
}

std::vector<std::string> states_of(const Model& model) {
  return {model.state_names.begin(),
          model.state_names.begin() + static_cast<std::ptrdiff_t>(model.reported_dimension())};
}

py::dict analysis_of(const PyModel& self) {
  const ModelAnalysis a = self.text().analysis();
  py::dict brackets, inputs;
  for (const auto& [name, between] : a.inputs)
    inputs[py::str(name)] = between == Between::linear ? "linear" : "previous";
  for (const auto& b : a.brackets) brackets[py::make_tuple(b.i, b.j)] = b.components;
  using namespace py::literals;
  return py::dict("states"_a = a.states, "convention"_a = a.convention, "correlation"_a = a.correlation,
                  "inputs"_a = inputs, "ito_drift"_a = a.ito_drift, "fields"_a = a.fields,
                  "jacobians"_a = a.jacobians, "brackets"_a = brackets, "sensor"_a = a.sensor,
                  "sensor_derivative"_a = a.sensor_derivative, "log_likelihood"_a = a.log_likelihood,
                  "affine_fields"_a = a.affine_fields, "has_exact_flow"_a = a.has_exact_flow,
                  "exact_filter"_a = a.exact_filter_name, "exact_filter_reason"_a = a.exact_filter_reason,
                  "square_roots"_a = a.square_roots, "square_roots_reason"_a = a.square_roots_reason);
}

std::string shown(const PyModel& self) {
  std::string text = "<wienertree.Model " + self.model().name + ":";
  for (const std::string& state : states_of(self.model())) text += " " + state;
  text += ", " + std::to_string(self.model().noise_dimension()) + " Brownian, observation " +
          observation_kind(self.model());
  return text + ">";
}

py::object simulate_model(const py::object& source, double horizon, std::size_t steps,
                          std::optional<std::size_t> keep, std::uint64_t seed, const py::object& set) {
  const PyModel model = PyModel::make(source, assignments_of(set));
  Simulation drawn;
  {
    const py::gil_scoped_release unlocked;
    drawn = simulate(model.model(), horizon, steps, keep.value_or(steps), seed);
  }
  const std::size_t k = drawn.observations.dimension;
  return py::module_::import("wienertree.results")
      .attr("Simulation")(
          hand_over(std::move(drawn.signal.times)), hand_over_rows(std::move(drawn.observations.values), k),
          hand_over_rows(std::move(drawn.signal.values), drawn.signal.dimension), states_of(model.model()));
}

PyModel with_inputs_of(const PyModel& self, const py::object& times, const py::kwargs& inputs) {
  if (inputs.empty()) throw InputError("needs the values of an input, NAME=values", "with_inputs");
  const Doubles t = doubles_of(times, "times");
  std::vector<InputFunction> functions;
  for (const auto& [name, values] : inputs) {
    InputFunction& f = functions.emplace_back();
    f.name = name.cast<std::string>();
    const Doubles u = doubles_of(values, f.name);
    f.times.assign(values_of(t).begin(), values_of(t).end());
    f.values.assign(values_of(u).begin(), values_of(u).end());
    if (f.times.empty()) throw InputError("needs at least one time", "times");
  }
  return self.with_inputs(std::move(functions));
}

py::tuple inputs_of(const PyModel& self) {
  py::dict values;
  py::object times = py::none();
  for (const InputFunction& f : self.inputs()) {
    values[py::str(f.name)] = hand_over(std::vector<double>(f.values));
    times = hand_over(std::vector<double>(f.times));
  }
  return py::make_tuple(times, values);
}

py::tuple read_observation_file(const py::object& file, const py::object& source, const py::object& set) {
  const PyModel model = PyModel::make(source, assignments_of(set));
  const std::size_t k = model.model().observation_dimension();
  ObservationPath path =
      read_observations(py::module_::import("os").attr("fspath")(file).cast<std::string>(), model.model());
  return py::make_tuple(hand_over(std::move(path.times)), hand_over_rows(std::move(path.values), k));
}

}  // namespace

app::Assignments assignments_of(const py::object& set) {
  app::Assignments all;
  if (set.is_none()) return all;
  for (const auto& [name, value] : set.cast<py::dict>())
    all.emplace_back(name.cast<std::string>(), value.cast<double>());
  return all;
}

PyModel PyModel::with_inputs(std::vector<InputFunction> inputs) const {
  PyModel known(text_.with_inputs(inputs, "inputs"), source_, set_);
  known.inputs_ = std::move(inputs);
  return known;
}

PyModel PyModel::make(const py::handle& source, const app::Assignments& set) {
  std::string text;
  const char* origin = text_origin;
  app::Assignments all;
  std::vector<InputFunction> inputs;
  if (py::isinstance<PyModel>(source)) {
    const auto& model = source.cast<const PyModel&>();
    if (set.empty()) return model;
    text = model.source_;
    all = model.set_;
    inputs = model.inputs_;
  } else if (py::isinstance<py::dict>(source)) {
    text = py::module_::import("wienertree.model_text").attr("to_toml")(source).cast<std::string>();
    origin = dict_origin;
  } else if (py::isinstance<py::str>(source)) {
    text = source.cast<std::string>();
  } else {
    const py::module_ os = py::module_::import("os");
    text = os.attr("path").attr("abspath")(os.attr("fspath")(source)).cast<std::string>();
  }
  all.insert(all.end(), set.begin(), set.end());
  TextModel model = parse_or_load(text, origin, all);
  PyModel result(std::move(model), std::move(text), std::move(all));
  return inputs.empty() ? result : result.with_inputs(std::move(inputs));
}

void add_models(py::module_& module) {
  using namespace py::literals;
  py::class_<PyModel>(module, "Model", R"(A signal and its observation.

source: the name of a bundled model (see models()), a path of a model file, the text of one (more than one
line), or a dict of the same structure. set: values that replace parameters, {"kappa": 1.5}.

Raises InputError naming file, line, column and key.)")
      .def(py::init([](const py::object& source, const py::object& set) {
             return PyModel::make(source, assignments_of(set));
           }),
           "source"_a, py::kw_only(), "set"_a = py::none())
      .def_property_readonly("name", [](const PyModel& m) { return m.model().name; })
      .def_property_readonly(
          "states", [](const PyModel& m) { return states_of(m.model()); }, "Names of the d states.")
      .def_property_readonly(
          "parameters",
          [](const PyModel& m) {
            py::dict all;
            for (const auto& [name, value] : m.model().parameters) all[py::str(name)] = value;
            return all;
          },
          "Parameters and their values.")
      .def_property_readonly(
          "noise_dimension", [](const PyModel& m) { return m.model().noise_dimension(); },
          "Number of Brownian motions, p.")
      .def_property_readonly(
          "observation", [](const PyModel& m) { return observation_kind(m.model()); },
          "'none', 'continuous' or 'discrete'.")
      .def_property_readonly(
          "observation_dimension", [](const PyModel& m) { return m.model().observation_dimension(); },
          "Components of an observation, k.")
      .def_property_readonly(
          "initial",
          [](const PyModel& m) {
            std::vector<double> start = m.model().initial;
            start.resize(m.model().reported_dimension());
            return hand_over(std::move(start));
          },
          "Start of the signal, or its mean (d).")
      .def("analysis", &analysis_of,
           "What follows from the coefficients, as expressions: vector fields in both conventions, "
           "Jacobians,\n"
           "Lie brackets, sensor, and which exact filter applies.")
      .def(
          "replace",
          [](const py::object& self, const py::kwargs& parameters) {
            return PyModel::make(self, assignments_of(parameters));
          },
          "The same model with other values of parameters: model.replace(kappa=1.5).")
      .def("with_inputs", &with_inputs_of, "times"_a,
           R"(The same model with its [inputs] known, functions of time:
model.with_inputs(times, temperature=values, ..), every one as values at these increasing times.)")
      .def_property_readonly("inputs", &inputs_of, "Times and values, by name, of the inputs that are known.")
      .def("__repr__", &shown)
      .def("__reduce__", [](const py::object& self) {
        const auto& m = self.cast<const PyModel&>();
        py::dict set;
        for (const auto& [name, value] : m.set()) set[py::str(name)] = value;
        return py::make_tuple(py::module_::import("wienertree.model_text").attr("rebuilt"),
                              py::make_tuple(m.source(), set, inputs_of(m)));
      });

  module.def(
      "models", [] { return app::bundled_names("models", ".toml"); }, "Names of the bundled models.");
  module.def("simulate", &simulate_model, "model"_a, py::kw_only(), "horizon"_a, "steps"_a,
             "keep"_a = py::none(), "seed"_a = 1, "set"_a = py::none(),
             R"(A signal and its observations, drawn from a model by Euler's method on `steps` steps.

keep: rows kept after the first; divides steps (all of them if not given). Returns a Simulation.)");
  module.def("read_observations", &read_observation_file, "file"_a, "model"_a, py::kw_only(),
             "set"_a = py::none(),
             "Times (M) and values (M, k) of a CSV file with header t,y1,..; NaN where a value is missing.");
}

}  // namespace wienertree::python
