#include "filter_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "filter_arguments.hpp"
#include "filter_table.hpp"
#include "progress.hpp"
#include "wienertree/numeric/memory.hpp"

namespace wienertree::app {
namespace {

// The filters of one run, which take the same windows.
class SideBySide {
 public:
  SideBySide(const Model& model, const FilterSetup& setup, const FilterRequest& request)
      : model_(model), setup_(setup), request_(request), filter_(model, setup) {
    const std::optional<FilterMethod> exact = exact_method(model);
    if (exact && *exact != setup.options.method) exact_ = make_exact(model, *exact);
    if (!request.density_at) return;
    // The prior is the law without observations: by the exact filter where there is one.
    Model unobserved = model;
    unobserved.observation = ObservationKind::none;
    prior_ = exact ? make_exact(unobserved, *exact) : make_filter(unobserved, setup.options);
  }

  void advance(const ObservationWindow& window) {
    refuse_oversized_tree(model_, setup_.options, window.step);
    filter_.advance(window);
    if (exact_) exact_->advance(window);
    if (prior_ && run_.density.empty()) prior_->advance(window);
  }

  void record(double time) {
    filter_.summarise(time, request_.highest_moment, run_.last);
    const bool several = setup_.launches > 1;
    std::vector<double> row = filter_row(run_.last, several);
    if (request_.observe) request_.observe(row);
    if (request_.keep_rows) run_.rows.push_back(std::move(row));
    if (!run_.collapsed_at && run_.last.ratio && run_.last.ratio->collapsed()) run_.collapsed_at = time;
    if (exact_) record_exact(time);
    // 1e-9 relative: a step that ends at the asked time up to rounding.
    if (request_.density_at && run_.density.empty() &&
        time >= *request_.density_at - 1e-9 * std::fabs(time)) {
      run_.density_time = time;
      const auto states = states_of(model_);
      run_.density = density_panels({states.begin(), states.end()}, filter_.posterior(),
                                    exact_ ? &exact_->posterior() : nullptr, &prior_->posterior());
    }
  }

  /// All that the rest of the run depends on, and what it has to tell of the part before.
  void exchange(StateArchive& archive) {
    filter_.exchange(archive);
    for (Filter* other : {exact_.get(), prior_.get()})
      if (other != nullptr) other->exchange(archive);
    archive(run_.rows, run_.exact_rows, run_.last, run_.exact, run_.collapsed_at, run_.density,
            run_.density_time);
  }

  double time() const { return run_.last.mean.time; }

  FilterRun finish() {
    run_.statistics = filter_.statistics();
    return std::move(run_);
  }

 private:
  static std::unique_ptr<Filter> make_exact(const Model& model, FilterMethod method) {
    FilterOptions options;
    options.method = method;
    return make_filter(model, options);
  }

  void record_exact(double time) {
    if (!run_.exact) run_.exact.emplace();
    summarise(exact_->posterior(), model_.reported_dimension(), 0, *run_.exact);
    run_.exact->time = time;
    if (!request_.keep_exact_rows) return;
    LaunchesSummary one;
    one.mean = *run_.exact;
    run_.exact_rows.push_back(filter_row(one, false));
  }

  const Model& model_;
  const FilterSetup& setup_;
  const FilterRequest& request_;
  Launches filter_;
  std::unique_ptr<Filter> exact_, prior_;
  FilterRun run_;
};

void check_density_time(const FilterRequest& request, const WindowSource& windows) {
  if (!request.density_at) return;
  const double t = *request.density_at, slack = 1e-9 * std::fabs(t);
  if (t < windows.start() - slack || (windows.end() && t > *windows.end() + slack))
    throw InputError(windows.end() ? fmt::format("must be within the observations, {:g} .. {:g}",
                                                 windows.start(), *windows.end())
                                   : fmt::format("is before the first observation, at {:g}", windows.start()),
                     "--density-at", fmt::format("{}", t));
}

}  // namespace

FilterRun run_filter(const Model& model, const FilterSetup& setup, WindowSource& windows,
                     const FilterRequest& request, SavedRun& saved) {
  SideBySide filters(model, setup, request);
  const Exchange exchange = [&](StateArchive& archive) {
    windows.exchange(archive);
    filters.exchange(archive);
  };
  saved.resume(exchange);
  check_density_time(request, windows);
  refuse_oversized_tree(model, setup.options, windows.size());
  if (request.keep_rows) {
    // A row as numbers and as text.
    const std::size_t columns = filter_columns(model, setup, request.highest_moment).size();
    require_memory(static_cast<double>(windows.size()) * (28 * static_cast<double>(columns) + 48),
                   fmt::format("a table of {} rows", windows.size()), "--steps");
  }
  if (!saved.resumes() && !windows.observed_at_start()) filters.record(windows.start());
  {
    Progress progress("filter", windows.size(), request.progress);
    for (ObservationWindow window; !saved.interrupted() && windows.next(window);) {
      filters.advance(window);
      filters.record(window.end);
      progress.advance_to(window.step);
      saved.after_step(exchange);
    }
  }
  saved.finish(exchange, fmt::format("t = {:g}", filters.time()));
  FilterRun run = filters.finish();
  if (request.density_at && run.density.empty())
    throw InputError("the observations end before this time", "--density-at",
                     fmt::format("{}", *request.density_at));
  return run;
}

}  // namespace wienertree::app
