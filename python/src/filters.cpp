#include <pybind11/stl.h>

#include <chrono>

#include "arrays.hpp"
#include "bindings.hpp"
#include "filter_session.hpp"
#include "options.hpp"
#include "wienertree/filter/expectation.hpp"
#include "wienertree/filter/marginal.hpp"

namespace wienertree::python {
namespace {

using namespace py::literals;

// The columns of a result as they grow.
struct Columns {
  std::vector<double> t, mean, sd, q05, q50, q95, log_evidence, nodes, ess, mc_sd, mc_sd_log_evidence;
  std::vector<double> log_bayes_factor, log_variance;
  std::vector<std::vector<double>> moments;  // moments[k-2]

  void append(const LaunchesSummary& row, bool several) {
    const auto extend = [](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    const PosteriorSummary& s = row.mean;
    t.push_back(s.time);
    extend(mean, s.mean);
    extend(sd, s.sd);
    extend(q05, s.q05);
    extend(q50, s.q50);
    extend(q95, s.q95);
    log_evidence.push_back(s.log_evidence);
    nodes.push_back(row.nodes);
    ess.push_back(s.ess);
    const std::size_t orders = s.moments.empty() ? 0 : s.moments.front().size();
    moments.resize(orders);
    for (std::size_t k = 0; k < orders; ++k)
      for (const std::vector<double>& component : s.moments) moments[k].push_back(component[k]);
    if (row.ratio) {
      log_bayes_factor.push_back(row.ratio->log_mean);
      log_variance.push_back(row.ratio->log_variance);
    }
    if (!several) return;
    extend(mc_sd, row.mean_sd);
    mc_sd_log_evidence.push_back(row.log_evidence_sd);
  }
};

py::object rows_or_none(std::vector<double>&& values, std::size_t d) {
  return values.empty() ? py::object(py::none()) : py::object(hand_over_rows(std::move(values), d));
}

py::object column_or_none(std::vector<double>&& values) {
  return values.empty() ? py::object(py::none()) : py::object(hand_over(std::move(values)));
}

py::dict statistics_of(const FilterStatistics& s) {
  return py::dict("steps"_a = s.steps, "children"_a = s.children, "ode_solves"_a = s.flow.node_segments,
                  "cvode_solves"_a = s.flow.cvode_nodes, "dropped_nodes"_a = s.dropped_nodes,
                  "discarded"_a = s.discarded);
}

py::object filter(const py::object& model, const py::object& observations, const py::kwargs& options) {
  FilterSession session(model, observations, options);
  Columns columns;
  const bool several = session.setup().launches > 1;
  const auto began = std::chrono::steady_clock::now();
  {
    const py::gil_scoped_release unlocked;
    Interrupts interrupts;
    while (session.search()) interrupts.check();
  }
  const ControlledFilter& control = session.control();
  const Accuracy accuracy = control.accuracy();
  for (const LaunchesSummary& row : control.answer().rows) columns.append(row, several);
  py::object error = py::none();
  if (accuracy.known)
    error = py::dict("mean"_a = accuracy.error.mean, "sd"_a = accuracy.error.sd,
                     "quantile"_a = accuracy.error.quantile, "log_evidence"_a = accuracy.error.log_evidence);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  const std::size_t d = session.states().size();
  py::dict moments;
  for (std::size_t k = 0; k < columns.moments.size(); ++k)
    moments[py::int_(k + 2)] = hand_over_rows(std::move(columns.moments[k]), d);
  return py::module_::import("wienertree.results")
      .attr("FilterResult")(
          "states"_a = session.states(), "t"_a = hand_over(std::move(columns.t)),
          "mean"_a = hand_over_rows(std::move(columns.mean), d),
          "sd"_a = hand_over_rows(std::move(columns.sd), d),
          "q05"_a = hand_over_rows(std::move(columns.q05), d),
          "q50"_a = hand_over_rows(std::move(columns.q50), d),
          "q95"_a = hand_over_rows(std::move(columns.q95), d), "moments"_a = moments,
          "log_evidence"_a = hand_over(std::move(columns.log_evidence)),
          "nodes"_a = hand_over(std::move(columns.nodes)), "ess"_a = hand_over(std::move(columns.ess)),
          "mc_sd"_a = rows_or_none(std::move(columns.mc_sd), d),
          "mc_sd_log_evidence"_a = column_or_none(std::move(columns.mc_sd_log_evidence)),
          "log_bayes_factor"_a = column_or_none(std::move(columns.log_bayes_factor)),
          "log_variance"_a = column_or_none(std::move(columns.log_variance)), "error"_a = error,
          "warnings"_a = control.warnings(), "options"_a = session.options_in_force(),
          "statistics"_a = statistics_of(session.statistics()), "seconds"_a = took.count());
}

// The law at one step: its numbers for good, its nodes until the filter takes the next step.
class StepPosterior {
 public:
  explicit StepPosterior(std::shared_ptr<FilterSession> session)
      : session_(std::move(session)), step_(session_->steps()), row_(session_->row()) {}
  const LaunchesSummary& row() const { return row_; }
  const FilterSession& session() const { return *session_; }

  // Calls f with the law itself. @throws RunError if it is gone
  template <class F>
  auto with_law(F&& f) const {
    const FilterSession::Use use(*session_);
    if (session_->steps() != step_)
      throw RunError("the filter has taken its next step: copy what is needed of a posterior before that",
                     "posterior at t = " + std::to_string(row_.mean.time));
    return f(session_->posterior());
  }

  std::size_t component(const py::object& state) const {
    const std::vector<std::string> names = session_->states();
    if (py::isinstance<py::str>(state)) return app::choose("state", state.cast<std::string>(), names);
    const auto i = state.cast<std::size_t>();
    if (i >= names.size()) throw py::index_error("no such state");
    return i;
  }

 private:
  std::shared_ptr<FilterSession> session_;
  std::size_t step_;
  LaunchesSummary row_;
};

py::array_t<double> copied(ConstBatchView view) {
  std::vector<double> values;
  values.reserve(view.components() * view.nodes());
  for (std::size_t i = 0; i < view.components(); ++i)
    values.insert(values.end(), view.component(i).begin(), view.component(i).end());
  return hand_over(std::move(values),
                   {static_cast<py::ssize_t>(view.components()), static_cast<py::ssize_t>(view.nodes())});
}

double expectation_of(const StepPosterior& self, const py::object& f) {
  if (py::isinstance<py::str>(f)) {
    const BatchFunction phi = self.session().text().compile(f.cast<std::string>(), "expectation");
    return self.with_law([&](const Posterior& law) { return expectation(law, phi); });
  }
  const std::size_t d = self.session().states().size();
  const BatchFunction phi = [&f, d](ConstBatchView x, std::span<double> out) {
    const Doubles values = f(copied(x.components(0, d))).cast<Doubles>();
    if (values.size() != static_cast<py::ssize_t>(out.size()))
      throw InputError("must return one value for each node", "expectation",
                       std::to_string(values.size()) + " for " + std::to_string(out.size()));
    std::copy_n(values.data(), out.size(), out.data());
  };
  return self.with_law([&](const Posterior& law) { return expectation(law, phi); });
}

py::array_t<double> at_points(const StepPosterior& self, const py::object& state, const Doubles& points,
                              double (Marginal::*of)(double) const) {
  std::vector<double> values(values_of(points).begin(), values_of(points).end());
  self.with_law([&](const Posterior& law) {
    const Marginal marginal(law, self.component(state));
    if (of == &Marginal::density && !marginal.has_density())
      throw InputError("a law of atoms has no density", "density");
    for (double& x : values) x = (marginal.*of)(x);
  });
  return hand_over(std::move(values), {points.shape(), points.shape() + points.ndim()});
}

py::array_t<double> quantiles(const StepPosterior& self, const py::object& state, const Doubles& levels) {
  const std::span<const double> wanted = values_of(levels);
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (!(wanted[i] > 0 && wanted[i] < 1) || (i > 0 && wanted[i] < wanted[i - 1]))
      throw InputError("levels must be inside (0, 1) and ascend", "quantiles", std::to_string(wanted[i]));
  std::vector<double> out(wanted.size());
  self.with_law([&](const Posterior& law) { Marginal(law, self.component(state)).quantiles(wanted, out); });
  return hand_over(std::move(out));
}

template <class Get>
auto summary(Get get) {
  return [get](const StepPosterior& p) { return get(p.row()); };
}

void add_posterior(py::module_& module) {
  const auto vector = [](std::vector<double> PosteriorSummary::*part) {
    return [part](const StepPosterior& p) { return hand_over(std::vector<double>(p.row().mean.*part)); };
  };
  py::class_<StepPosterior>(module, "Posterior", R"(The law of the signal at one step of a Filter.

Its numbers stay; points, weights, expectation, density, distribution and quantiles speak of the law itself and
raise RunError once the filter has taken its next step.)")
      .def_property_readonly("t", summary([](const auto& r) { return r.mean.time; }))
      .def_property_readonly("mean", vector(&PosteriorSummary::mean), "(d)")
      .def_property_readonly("sd", vector(&PosteriorSummary::sd), "(d)")
      .def_property_readonly("q05", vector(&PosteriorSummary::q05), "5 % quantiles (d)")
      .def_property_readonly("q50", vector(&PosteriorSummary::q50), "Medians (d)")
      .def_property_readonly("q95", vector(&PosteriorSummary::q95), "95 % quantiles (d)")
      .def_property_readonly("log_evidence", summary([](const auto& r) { return r.mean.log_evidence; }),
                             "Log of the likelihood of the observations so far.")
      .def_property_readonly("nodes", summary([](const auto& r) { return r.nodes; }))
      .def_property_readonly("ess", summary([](const auto& r) { return r.mean.ess; }),
                             "Effective sample size.")
      .def_property_readonly(
          "points",
          [](const StepPosterior& p) {
            return p.with_law([&](const Posterior& law) {
              return copied(law.points.components(0, p.session().states().size()));
            });
          },
          "Nodes, or means of the Gaussians (d, N); copied, since the filter goes on using its own.")
      .def_property_readonly(
          "weights",
          [](const StepPosterior& p) {
            return p.with_law([](const Posterior& law) {
              return hand_over(std::vector<double>(law.weight.begin(), law.weight.end()));
            });
          },
          "Their weights (N), of sum 1.")
      .def("expectation", &expectation_of, "f"_a,
           "E[f(X)]: f is an expression of the states, or a function of an array (d, N) with N values.")
      .def(
          "density",
          [](const StepPosterior& p, const py::object& state, const Doubles& x) {
            return at_points(p, state, x, &Marginal::density);
          },
          "state"_a, "x"_a, "Density of a state, by name or number, at the points x.")
      .def(
          "distribution",
          [](const StepPosterior& p, const py::object& state, const Doubles& x) {
            return at_points(p, state, x, &Marginal::distribution);
          },
          "state"_a, "x"_a, "P(X_state <= x) at the points x.")
      .def("quantiles", &quantiles, "state"_a, "levels"_a, "Quantiles of a state, for ascending levels.")
      .def("__repr__", [](const StepPosterior& p) {
        return "<wienertree.Posterior: t = " + std::to_string(p.row().mean.time) + ", " +
               std::to_string(static_cast<long long>(p.row().nodes)) + " nodes>";
      });
}

std::string filter_docstring(const std::string& opening) {
  CLI::App app;
  FilterRequested requested;
  add_session_options(app, requested);
  return opening + R"(

model: a Model, or what makes one (a bundled name, a file, a text, a dict).
observations: a CSV file, a pair (t, y) of arrays (M) and (M) or (M, k), or a Simulation. Arrays of doubles
    are read where they lie. NaN is a missing value of a discrete observation.
set: values that replace parameters of the model, {"kappa": 1.5}.

The options of the command line, under the same names:

)" + options_text(app) +
         R"(
Raises InputError (a ValueError) for what is wrong with the input, RunError (a RuntimeError) naming step, time,
node and state where the computation fails.)";
}

}  // namespace

void add_filters(py::module_& module) {
  add_posterior(module);
  module.def("filter", &filter, "model"_a, "observations"_a,
             filter_docstring("The law of the signal given its observations, through time: a FilterResult.")
                 .c_str());
  py::class_<FilterSession, std::shared_ptr<FilterSession>>(
      module, "Filter",
      filter_docstring("A filter that is iterated over: one Posterior a step, the start first.").c_str())
      .def(py::init<const py::object&, const py::object&, const py::kwargs&>(), "model"_a, "observations"_a)
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__",
           [](const std::shared_ptr<FilterSession>& self) {
             const FilterSession::Use use(*self);
             const bool more = [&] {
               const py::gil_scoped_release unlocked;
               return self->advance();
             }();
             if (!more) throw py::stop_iteration();
             return StepPosterior(self);
           })
      .def_property_readonly("states", &FilterSession::states, "Names of the d states.")
      .def_property_readonly("options", &FilterSession::options_in_force, "All options in force.")
      .def_property_readonly(
          "statistics", [](const FilterSession& s) { return statistics_of(s.statistics()); },
          "Work done so far.");
}

}  // namespace wienertree::python
