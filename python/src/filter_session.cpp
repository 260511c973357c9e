#include "filter_session.hpp"

#include "formulas.hpp"
#include "options.hpp"

namespace wienertree::python {
namespace {

// Takes a keyword argument that is no option.
py::object taken(py::dict& options, const char* name) {
  return options.contains(name) ? py::object(options.attr("pop")(name)) : py::object(py::none());
}

bool is_file(const py::object& observations) {
  return py::isinstance<py::str>(observations) || py::hasattr(observations, "__fspath__");
}

}  // namespace

void add_session_options(CLI::App& app, FilterRequested& requested) {
  app::add_record_steps(app, requested.steps);
  app::add_filter_options(app, requested.filter);
  app::add_moments(app, requested.moments);
  app::add_accuracy_options(app, requested.accuracy);
}

FilterSession::FilterSession(const py::object& model, const py::object& observations, py::dict options)
    : model_(PyModel::make(model, assignments_of(taken(options, "set")))) {
  const Model& m = model_.model();
  if (m.observation == ObservationKind::none)
    throw InputError("the model has no [observation]: there is nothing to filter by", "model " + m.name);
  CLI::App app("", "filter");
  FilterRequested requested;
  add_session_options(app, requested);
  const std::optional<CubatureFormula> formula = take_formula(options);
  set_options(app, options);
  if (formula && requested.filter.degree)
    throw InputError("give --formula or --degree, not both", "--formula", formula->name);
  if (formula) require_usable(*formula, m.noise_dimension());
  requested.filter.formula = formula;
  setup_ = app::filter_setup(requested.filter, m);
  if (formula && setup_.options.formula.paths.empty())
    throw InputError("has no meaning with --method " + app::method_name(setup_.options.method), "--formula");
  highest_moment_ = static_cast<int>(requested.moments.value_or(0));
  read(observations, requested.steps);
  control_ = std::make_unique<ControlledFilter>(
      m, setup_,
      app::control_options(requested.accuracy, requested.filter, requested.steps, requested.moments),
      *source_->record());
}

void FilterSession::read(const py::object& observations, std::optional<std::size_t> steps) {
  const Model& m = model_.model();
  if (is_file(observations)) {
    const auto file = py::module_::import("os").attr("fspath")(observations).cast<std::string>();
    if (file == "-") throw InputError("standard input is not read here", "observations", file);
    source_ = open_windows(file, m, steps);
    return;
  }
  if (py::hasattr(observations, "observations")) {  // a Simulation
    times_ = doubles_of(observations.attr("t"), "observations, t");
    values_ = doubles_of(observations.attr("observations"), "observations, y");
  } else {
    if (!py::isinstance<py::tuple>(observations) || py::len(observations) != 2)
      throw InputError("must be a file, a pair (t, y) of arrays or a Simulation", "observations",
                       py::str(py::type::of(observations).attr("__name__")).cast<std::string>());
    times_ = doubles_of(observations[py::int_(0)], "observations, t");
    values_ = doubles_of(observations[py::int_(1)], "observations, y");
  }
  const auto k = static_cast<py::ssize_t>(m.observation_dimension());
  const bool shaped =
      times_.ndim() == 1 && (values_.ndim() == 2 ? values_.shape(1) == k : values_.ndim() == 1);
  if (!shaped)
    throw InputError(
        "must be t (M) and y (M, " + std::to_string(k) + ")", "observations",
        "dimensions " + std::to_string(times_.ndim()) + " and " + std::to_string(values_.ndim()));
  const ObservationRows rows{m.observation_dimension(), values_of(times_), values_of(values_)};
  check_observations(rows, "observations", m.observation);
  source_ = cut_windows(rows, m, steps);
}

bool FilterSession::advance() {
  if (finished_) return false;
  finished_ = true;  // should what follows throw
  if (!launches_) {
    while (control_->advance()) {
    }
    setup_ = control_->answer_setup();
    windows_.emplace(control_->answer_windows());
    launches_ = std::make_unique<Launches>(model_.model(), setup_);
  }
  const std::vector<LaunchesSummary>& rows = control_->answer().rows;
  if (steps_ == rows.size()) return false;
  // The answer has a row at the start unless an observation is weighed there.
  const double time = rows[steps_].mean.time;
  const bool at_start = steps_ == 0 && (windows_->size() == 0 || windows_->time(0) > windows_->start());
  for (bool there = at_start; !there && next_ < windows_->size();) {
    windows_->get(next_++, window_);
    launches_->advance(window_);
    there = window_.end == time;
  }
  ++steps_;
  launches_->summarise(time, highest_moment_, row_);
  finished_ = false;
  return true;
}

std::vector<std::string> FilterSession::states() const {
  const Model& m = model_.model();
  return {m.state_names.begin(), m.state_names.begin() + static_cast<std::ptrdiff_t>(m.reported_dimension())};
}

py::dict FilterSession::options_in_force() const {
  return to_dict(app::options_in_force(launches_ ? setup_ : control_->chosen_setup(), model_.model()));
}

FilterSession::Use::Use(FilterSession& session) : session_(session) {
  if (session.in_use_.exchange(true)) throw RunError("is in use by another thread", "filter");
}

}  // namespace wienertree::python
