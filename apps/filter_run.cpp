#include "filter_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "filter_arguments.hpp"
#include "filter_table.hpp"
#include "progress.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/run/stream_guard.hpp"

namespace wienertree::app {
namespace {

std::unique_ptr<Filter> make_exact(const Model& model, FilterMethod method) {
  FilterOptions options;
  options.method = method;
  return make_filter(model, options);
}

// The exact filter beside an approximation, where the model has one.
std::unique_ptr<Filter> exact_beside(const Model& model, const FilterSetup& setup) {
  const std::optional<FilterMethod> exact = exact_method(model);
  return exact && *exact != setup.options.method ? make_exact(model, *exact) : nullptr;
}

// The law without observations: by the exact filter where there is one.
std::unique_ptr<Filter> prior_of(const Model& model, const FilterSetup& setup) {
  Model unobserved = model;
  unobserved.observation = ObservationKind::none;
  if (const auto exact = exact_method(model)) return make_exact(unobserved, *exact);
  FilterOptions options = setup.options;
  options.conditioning = Conditioning::children;
  return make_filter(unobserved, options);
}

// 1e-9 relative: a step that ends at the asked time up to rounding.
bool reaches(double time, double wanted) { return time >= wanted - 1e-9 * std::fabs(time); }

void check_density_time(const FilterRequest& request, double start, std::optional<double> end) {
  if (!request.density_at) return;
  const double t = *request.density_at, slack = 1e-9 * std::fabs(t);
  if (t < start - slack || (end && t > *end + slack))
    throw InputError(end ? fmt::format("must be within the observations, {:g} .. {:g}", start, *end)
                         : fmt::format("is before the first observation, at {:g}", start),
                     "--density-at", fmt::format("{}", t));
}

void keep_exact(FilterRun& run, const Model& model, Filter& exact, double time, bool rows) {
  if (!run.exact) run.exact.emplace();
  summarise(exact.posterior(), model.reported_dimension(), 0, *run.exact);
  run.exact->time = time;
  if (!rows) return;
  LaunchesSummary one;
  one.mean = *run.exact;
  run.exact_rows.push_back(filter_row(one, false));
}

void keep_density(FilterRun& run, const Model& model, double time, const Posterior& law, Filter* exact,
                  Filter& prior) {
  run.density_time = time;
  const auto states = states_of(model);
  run.density = density_panels({states.begin(), states.end()}, law, exact ? &exact->posterior() : nullptr,
                               &prior.posterior());
}

// The exact filter over the record, a window from one row of the table to the next.
void run_exact(FilterRun& run, const Model& model, const ControlOptions& control, ObservationRows rows,
               const FilterRequest& request) {
  const auto exact = exact_beside(model, run.setup);
  if (!exact) return;
  const bool continuous = model.observation == ObservationKind::continuous;
  const std::size_t steps =
      continuous ? control.steps.value_or(default_steps(rows, model.observation)) : rows.rows() - 1;
  const ObservationWindows windows(rows, model.observation, model.timing, steps);
  if (windows.size() == 0 || windows.time(0) > windows.start())
    keep_exact(run, model, *exact, windows.start(), request.keep_exact_rows);
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size(); ++j) {
    windows.get(j, window);
    exact->advance(window);
    keep_exact(run, model, *exact, window.end, request.keep_exact_rows);
  }
}

// The law at one time: the answer's windows once more, up to there.
void run_density(FilterRun& run, const Model& model, const ObservationWindows& windows, double density_at) {
  Launches filter(model, run.setup);
  const auto exact = exact_beside(model, run.setup);
  const auto prior = prior_of(model, run.setup);
  double time = windows.start();
  ObservationWindow window;
  for (std::size_t j = 0; j < windows.size() && (j == 0 || !reaches(time, density_at)); ++j) {
    windows.get(j, window);
    if (window.length() > 0 && reaches(time, density_at)) break;
    filter.advance(window);
    if (exact) exact->advance(window);
    prior->advance(window);
    time = window.end;
  }
  keep_density(run, model, time, filter.posterior(), exact.get(), *prior);
}

}  // namespace

FilterRun filter_record(const Model& model, const FilterSetup& setup, const ControlOptions& control,
                        ObservationRows rows, const FilterRequest& request, SavedRun& saved) {
  check_density_time(request, rows.times.front(), rows.times.back());
  ControlledFilter filter(model, setup, control, rows);
  const Exchange exchange = [&](StateArchive& archive) { filter.exchange(archive); };
  saved.resume(exchange);
  if (request.keep_rows) {
    // A row as numbers and as text.
    const std::size_t columns =
        filter_columns(model, setup, static_cast<int>(control.highest_moment), request.errors).size();
    const std::size_t table = model.observation == ObservationKind::discrete
                                  ? rows.rows()
                                  : control.steps.value_or(default_steps(rows, model.observation)) + 1;
    require_memory(static_cast<double>(table) * (28 * static_cast<double>(columns) + 48),
                   fmt::format("a table of {} rows", table), "--steps");
  }
  {
    Progress progress("filter", 0, request.progress);
    while (!saved.interrupted() && filter.advance()) {
      progress.advance_to(filter.windows_done());
      saved.after_step(exchange);
    }
  }
  saved.finish(exchange, fmt::format("t = {:g}", filter.time()));
  FilterRun run;
  const Accuracy accuracy = filter.accuracy();
  const FinishedRun& answer = filter.answer();
  run.setup = filter.answer_setup();
  run.start = rows.times.front();
  run.error = accuracy.error;
  run.error_known = accuracy.known;
  run.warnings = filter.warnings();
  run.statistics = answer.statistics;
  run.last = answer.rows.back();
  for (std::size_t r = 0; r < answer.rows.size(); ++r) {
    const LaunchesSummary& row = answer.rows[r];
    if (!run.collapsed_at && row.ratio && row.ratio->collapsed()) run.collapsed_at = row.mean.time;
    run.rows.push_back(filter_row(row, run.setup.launches > 1));
    if (request.errors) append(run.rows.back(), accuracy.rows[r]);
  }
  run_exact(run, model, control, rows, request);
  if (request.density_at) run_density(run, model, filter.answer_windows(), *request.density_at);
  return run;
}

FilterRun filter_stream(const Model& model, const FilterSetup& setup, const ControlOptions& control,
                        WindowSource& windows, const FilterRequest& request, SavedRun& saved) {
  FilterRun run;
  run.setup = setup;
  StreamGuard filter(model, setup, control);
  const auto exact = exact_beside(model, setup);
  const auto prior = request.density_at ? prior_of(model, setup) : nullptr;
  const Exchange exchange = [&](StateArchive& archive) {
    windows.exchange(archive);
    filter.exchange(archive);
    for (Filter* other : {exact.get(), prior.get()})
      if (other != nullptr) other->exchange(archive);
    archive(run.rows, run.exact_rows, run.last, run.exact, run.collapsed_at, run.density, run.density_time);
  };
  saved.resume(exchange);
  check_density_time(request, windows.start(), windows.end());
  const auto record = [&](double time) {
    const AnswerError error = filter.summarise(time, static_cast<int>(control.highest_moment), run.last);
    std::vector<double> row = filter_row(run.last, setup.launches > 1);
    if (request.errors) append(row, error);
    if (request.observe) request.observe(row);
    if (request.keep_rows) run.rows.push_back(std::move(row));
    if (!run.collapsed_at && run.last.ratio && run.last.ratio->collapsed()) run.collapsed_at = time;
    if (exact) keep_exact(run, model, *exact, time, request.keep_exact_rows);
    if (request.density_at && run.density.empty() && reaches(time, *request.density_at))
      keep_density(run, model, time, filter.posterior(), exact.get(), *prior);
  };
  if (!saved.resumes() && !windows.observed_at_start()) record(windows.start());
  for (ObservationWindow window; !saved.interrupted() && windows.next(window);) {
    refuse_oversized_tree(model, setup.options, window.step);
    filter.advance(window);
    if (exact) exact->advance(window);
    if (prior && run.density.empty()) prior->advance(window);
    record(window.end);
    saved.after_step(exchange);
  }
  saved.finish(exchange, fmt::format("t = {:g}", run.last.mean.time));
  if (request.density_at && run.density.empty())
    throw InputError("the observations end before this time", "--density-at",
                     fmt::format("{}", *request.density_at));
  run.start = windows.start();
  run.statistics = filter.statistics();
  run.error = filter.error();
  run.error_known = filter.error_known();
  run.warnings = filter.warnings();
  return run;
}

}  // namespace wienertree::app
