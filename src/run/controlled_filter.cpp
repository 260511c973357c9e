#include "wienertree/run/controlled_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "wienertree/run/window_source.hpp"

namespace wienertree {
namespace {

constexpr int most_levels = 12;
constexpr const char* work_is_spent = "the work is spent";

// Runs beside the answer, in the order in which they are made.
constexpr std::pair<RunRole, const char*> guards[] = {
    {RunRole::steps, "other steps"},     {RunRole::nodes, "half the nodes"},
    {RunRole::degree, "another degree"}, {RunRole::rows, "other functionals of the rows"},
    {RunRole::launch_1, "another seed"}, {RunRole::launch_2, "another seed"}};

// Every interval between `coarse` in 2^halvings parts, at the nearest rows, as far as there are rows.
std::vector<std::size_t> refined(std::span<const double> times, std::vector<std::size_t> coarse,
                                 int halvings) {
  for (int h = 0; h < halvings; ++h) {
    std::vector<std::size_t> fine = {coarse.front()};
    for (std::size_t j = 1; j < coarse.size(); ++j) {
      const std::size_t first = coarse[j - 1], last = coarse[j];
      if (last - first > 1)
        fine.push_back(first + rows_on_grid(times.subspan(first, last - first + 1), 2)[1]);
      fine.push_back(last);
    }
    coarse.swap(fine);
  }
  return coarse;
}

std::vector<std::size_t> every_other(const std::vector<std::size_t>& rows) {
  std::vector<std::size_t> some;
  for (std::size_t j = 0; j < rows.size(); ++j)
    if (j % 2 == 0 || j + 1 == rows.size()) some.push_back(rows[j]);
  return some;
}

}  // namespace

struct ControlledFilter::Plan {
  RunRole role;
  int level;
  FilterSetup setup;
  ObservationWindows windows;
};

struct ControlledFilter::Run {
  Run(const Model& model, Plan what) : plan(std::move(what)), launches(model, plan.setup) {
    result.role = plan.role;
    result.level = plan.level;
  }
  Plan plan;
  Launches launches;
  std::size_t next = 0;  ///< window
  ObservationWindow window;
  FinishedRun result;
};

void FinishedRun::exchange(StateArchive& archive) {
  archive(role, level, rows, statistics, warnings, failure, failure_where, failure_value);
}

ControlledFilter::ControlledFilter(const Model& model, const FilterSetup& setup,
                                   const ControlOptions& control, ObservationRows rows)
    : model_(model), setup_(setup), control_(control), rows_(rows) {
  const ObservationKind kind = model.observation;
  if (control.steps && kind == ObservationKind::discrete)
    setup_.options.conditioning = Conditioning::children;
  if (kind == ObservationKind::continuous) {
    const std::size_t gaps = rows.rows() - 1, outputs = control.steps.value_or(default_steps(rows, kind));
    if (outputs > gaps)
      throw InputError(fmt::format("more steps than the observation has gaps between rows ({})", gaps),
                       "steps", std::to_string(outputs));
    output_rows_ = rows_on_grid(rows.times, outputs);
  }
  // Everything that can be wrong with the options is told now.
  const Plan first = plan(RunRole::level, 1);
  refuse_oversized_tree(model_, first.setup.options, first.windows.size());
  make_filter(model_, first.setup.options);
}

ControlledFilter::~ControlledFilter() = default;
ControlledFilter::ControlledFilter(ControlledFilter&&) noexcept = default;

bool ControlledFilter::closed_form() const {
  return !keeps_nodes(setup_.options.method) && setup_.options.method != FilterMethod::grid;
}

ControlledFilter::Plan ControlledFilter::plan(RunRole role, int level) const {
  FilterSetup setup = setup_;
  FilterOptions& o = setup.options;
  const bool grid = o.method == FilterMethod::grid, free = !setup.random && !closed_form();
  std::size_t& nodes = grid ? o.grid_points : o.nodes;
  const bool doubles_nodes = free && !control_.nodes_given && o.method != FilterMethod::full_tree;
  // Merging components costs accuracy with every substep, and is halved by four times as many.
  const bool components = o.conditioning == Conditioning::components;
  const int doublings = components && model_.reported_dimension() <= 3 ? 2 : 1;
  if (free && level == 0 && (doubles_nodes || control_.steps))
    nodes = std::max<std::size_t>(1, nodes >> doublings);
  if (doubles_nodes && level > 1) nodes <<= doublings * (level - 1);
  // A grid that was asked for is taken, or refused, as it is; halves of it have cells enough for a posterior.
  if (grid) nodes = std::max(nodes, std::min<std::size_t>(setup_.options.grid_points, 64));
  if (role == RunRole::nodes) nodes = std::max<std::size_t>(1, nodes / 2);
  if (free) o.substep_tolerance = std::ldexp(o.substep_tolerance, 1 - level);
  if (grid) o.grid_step = std::ldexp(o.grid_step, 1 - level);
  if (role == RunRole::degree) o.formula = *other_formula();
  if (role == RunRole::launch_1 || role == RunRole::launch_2) {
    nodes = std::max<std::size_t>(1, nodes / 4);
    o.seed = o.seed * 3 + (role == RunRole::launch_1 ? 1 : 2) + 0x9e3779b97f4a7c15;
  }

  // Halvings of the steps between outputs; below 0: steps twice as long.
  int halvings = free && !control_.steps ? level - 1 : 0;
  if (setup.random && role != RunRole::level) halvings = 1;
  if (o.method == FilterMethod::full_tree) halvings = 0;
  const bool coarser = model_.observation == ObservationKind::continuous && output_rows_.size() > 2;
  if (role == RunRole::steps) halvings += coarser ? -1 : 1;
  if (model_.observation == ObservationKind::continuous) {
    const std::vector<std::size_t> boundaries = rows_with_jumps(
        halvings < 0 ? every_other(output_rows_) : refined(rows_.times, output_rows_, halvings), rows_.times,
        model_.jumps());
    bool linear = role == RunRole::rows;
    if (linear && !closed_form() && o.functional != FunctionalMethod::second_order) {
      o.functional = FunctionalMethod::second_order;  // knows more of the rows
      linear = false;
    }
    return {role, level, std::move(setup), ObservationWindows(rows_, boundaries, linear)};
  }
  std::size_t steps = control_.steps.value_or(default_steps(rows_, model_.observation));
  if (o.conditioning != Conditioning::children && !control_.steps)
    steps = rows_.rows() - 1;  // the filter chooses its own inside
  else if (halvings > 0)
    steps <<= halvings;
  return {role, level, std::move(setup),
          ObservationWindows(rows_, model_.observation, model_.timing, steps, model_.jumps())};
}

// An unpruned tree has no room for a formula of more paths.
std::optional<CubatureFormula> ControlledFilter::other_formula() const {
  const int m = setup_.options.formula.degree;
  // Components move by moment equations.
  if (setup_.options.formula.paths.empty() || setup_.options.conditioning == Conditioning::components)
    return {};
  return alone() ? formula_of_degree(m - 2, model_, control_.formulas)
                 : other_degree(m, model_, control_.formulas);
}

bool ControlledFilter::alone() const {
  return closed_form() || setup_.options.method == FilterMethod::full_tree;
}

bool ControlledFilter::applies(RunRole role) const {
  const FilterOptions& o = setup_.options;
  const bool continuous = model_.observation == ObservationKind::continuous;
  if (setup_.random) return role == RunRole::launch_1 || role == RunRole::launch_2;
  switch (role) {
    case RunRole::level:
      return true;
    case RunRole::steps:
      if (o.method == FilterMethod::full_tree) return continuous && output_rows_.size() > 2;
      return control_.steps && !closed_form() && o.method != FilterMethod::grid;
    case RunRole::nodes:
      return control_.nodes_given && !control_.steps && !closed_form() && o.method != FilterMethod::full_tree;
    case RunRole::degree:
      return other_formula().has_value();
    case RunRole::rows:
      return continuous;
    case RunRole::launch_1:
    case RunRole::launch_2:
      return false;
  }
  return false;
}

const FinishedRun* ControlledFilter::find(RunRole role, int level) const {
  for (const FinishedRun& run : finished_)
    if (run.role == role && run.level == level) return &run;
  return nullptr;
}

// The highest level that came to an end.
int ControlledFilter::answer_level() const {
  int level = -1;
  for (const FinishedRun& run : finished_)
    if (run.role == RunRole::level && !run.failed()) level = std::max(level, run.level);
  return level;
}

RowErrors ControlledFilter::difference_of_levels(int level) const {
  const FinishedRun *answer = find(RunRole::level, level), *below = find(RunRole::level, level - 1);
  if (alone() || below == nullptr || below->failed()) return {};
  RowErrors errors = differences(answer->rows, below->rows);
  // From one level of components to the next up to .55 of an error was left.
  if (setup_.options.conditioning == Conditioning::components)
    for (AnswerError& e : errors) e *= 1.2;
  return errors;
}

RowErrors ControlledFilter::errors_of(int level) const {
  RowErrors errors;
  const FinishedRun* answer = find(RunRole::level, level);
  if (setup_.random) {
    // Of a quarter of the particles: twice the answer's standard deviation each. The larger of the two.
    for (const RunRole role : {RunRole::launch_1, RunRole::launch_2})
      if (const FinishedRun* run = find(role, level); run != nullptr && !run->failed()) {
        const RowErrors some = differences(answer->rows, run->rows);
        errors.resize(some.size());
        for (std::size_t r = 0; r < some.size(); ++r)
          errors[r] = {std::max(errors[r].mean, some[r].mean), std::max(errors[r].sd, some[r].sd),
                       std::max(errors[r].quantile, some[r].quantile),
                       std::max(errors[r].log_evidence, some[r].log_evidence)};
      }
    return errors;
  }
  const int guarded = alone() ? level : level - 1;
  const FinishedRun* below = find(RunRole::level, guarded);
  errors = difference_of_levels(level);
  for (const auto& [role, name] : guards) {
    const FinishedRun* run = find(role, guarded);
    if (run == nullptr || run->failed() || below == nullptr || below->failed()) continue;
    RowErrors some = differences(run->rows, below->rows);
    // A run with half the steps errs at least three times as much as one with all; one with twice the steps has a
    // quarter of the error left, which the difference lacks.
    if (role == RunRole::steps && model_.observation == ObservationKind::discrete)
      for (AnswerError& e : some) e *= 1.5;
    // The rows of a guard with longer steps are fewer.
    if (some.size() != answer->rows.size()) {
      RowErrors all(answer->rows.size());
      std::size_t next = 0;
      for (std::size_t r = 0; r < all.size(); ++r) {
        while (next + 1 < some.size() && run->rows[next].mean.time < answer->rows[r].mean.time) ++next;
        all[r] = some[next];
      }
      some.swap(all);
    }
    add(errors, some);
  }
  if (closed_form() || !errors.empty()) {
    // Rounding to nine digits of the numbers and of the ODE solver's tolerance.
    errors.resize(answer->rows.size());
    for (std::size_t r = 0; r < errors.size(); ++r) {
      errors[r] += rounding_error(answer->rows[r].mean);
      if (!closed_form()) continue;
      // Continuous: Riccati's equation to 1e-6.
      if (model_.observation == ObservationKind::continuous) errors[r] += {1e-5, 1e-5, 1e-5, 1e-5};
    }
  }
  return errors;
}

bool ControlledFilter::affordable(int level) const {
  const bool grows = !control_.steps || !control_.nodes_given;
  if (level > most_levels || !grows || setup_.random || alone()) return false;
  const FinishedRun *last = find(RunRole::level, level - 1), *before = find(RunRole::level, level - 2);
  const std::size_t d = model_.reported_dimension();
  const double cost = work_of(last->statistics, d),
               growth = before == nullptr || before->failed()
                            ? 4.0
                            : std::clamp(cost / std::max(1.0, work_of(before->statistics, d)), 2.0, 8.0);
  // With the guards, which are runs of the level before.
  return work_ + 2 * growth * cost <= control_.work;
}

std::optional<ControlledFilter::Plan> ControlledFilter::next_guard(int level) const {
  for (const auto& [role, name] : guards)
    if (applies(role) && find(role, level) == nullptr) return plan(role, level);
  return {};
}

// No resolution helps against what the spacing of the rows leaves.
bool ControlledFilter::rows_too_far_apart(int level) const {
  const FinishedRun *rows = find(RunRole::rows, level), *run = find(RunRole::level, level);
  if (rows == nullptr || rows->failed() || run == nullptr || run->failed()) return false;
  return !largest(differences(run->rows, rows->rows)).within(control_.tolerance);
}

std::optional<ControlledFilter::Plan> ControlledFilter::next() const {
  if (setup_.random || alone()) {
    if (find(RunRole::level, 1) == nullptr) return plan(RunRole::level, 1);
    return answer_level() == 1 ? next_guard(1) : std::nullopt;
  }
  for (int level = 0; level <= 1; ++level)
    if (find(RunRole::level, level) == nullptr) return plan(RunRole::level, level);
  int level = 1;
  while (find(RunRole::level, level + 1) != nullptr) ++level;
  const FinishedRun *top = find(RunRole::level, level), *below = find(RunRole::level, level - 1);
  if (top->failed() || below->failed()) {
    // Nothing to compare: finer, as far as that may help.
    if (!(top->failed() && below->failed()) && affordable(level + 1)) return plan(RunRole::level, level + 1);
    return {};
  }
  // Steps that are given leave an error that more nodes do nothing for; the guards tell it once, in the end.
  const RowErrors by_levels = control_.steps ? difference_of_levels(level) : errors_of(level);
  const bool promising = largest(by_levels).within(control_.tolerance), more = affordable(level + 1);
  const bool refines = more && !rows_too_far_apart(level - 1);
  if (!promising && refines) return plan(RunRole::level, level + 1);
  // The best there will be: its guards, unless the work is spent.
  if (promising || work_ < control_.work)
    if (auto guard = next_guard(level - 1)) return guard;
  if (!control_.steps && refines && !largest(errors_of(level)).within(control_.tolerance))
    return plan(RunRole::level, level + 1);
  return {};
}

bool ControlledFilter::is_output(const Plan&, const ObservationWindow& window) const {
  if (model_.observation == ObservationKind::continuous) {
    // Ends of windows are rows; those of a coarser run are among the outputs.
    return std::ranges::any_of(output_rows_, [&](std::size_t r) { return rows_.times[r] == window.end; });
  }
  const auto at = std::ranges::lower_bound(rows_.times, window.end);
  return at != rows_.times.end() && *at == window.end;
}

bool ControlledFilter::advance() {
  if (!current_) {
    auto plan = next();
    if (!plan) {
      if (answer_level() < 0) {
        const FinishedRun& why = finished_.back();
        throw RunError(why.failure, why.failure_where, why.failure_value);
      }
      return false;
    }
    const RunRole role = plan->role;
    const int level = plan->level;
    try {
      current_ = std::make_unique<Run>(model_, *std::move(plan));
    } catch (const InputError& refusal) {
      // A finer run that there is no memory for; without any answer it is the caller's to know.
      if (answer_level() < 1) throw;
      finished_.push_back({role, level, {}, {}, {}, refusal.message(), refusal.where(), refusal.value()});
      return true;
    }
    const ObservationWindows& w = current_->plan.windows;
    if (w.size() == 0 || w.time(0) > w.start()) {
      current_->result.rows.emplace_back();
      current_->launches.summarise(w.start(), static_cast<int>(control_.highest_moment),
                                   current_->result.rows.back());
    }
  }
  Run& run = *current_;
  if (run.next == run.plan.windows.size()) {
    finish();
    return true;
  }
  try {
    run.plan.windows.get(run.next++, run.window);
    refuse_oversized_tree(model_, run.plan.setup.options, run.window.step);
    run.launches.advance(run.window);
    ++windows_done_;
    time_ = run.window.end;
    if (is_output(run.plan, run.window)) {
      run.result.rows.emplace_back();
      run.launches.summarise(run.window.end, static_cast<int>(control_.highest_moment),
                             run.result.rows.back());
    }
  } catch (const RunError& error) {
    run.result.failure = error.message();
    run.result.failure_where = error.where();
    run.result.failure_value = error.value();
    finish();
    return true;
  }
  // A run beyond the work that is left is given up, if there is an answer without it.
  if (run.next % 16 == 0 && answer_level() >= 1) {
    const double work = work_ + work_of(run.launches.statistics(), model_.reported_dimension());
    if (work > 1.2 * control_.work) {
      run.result.failure = work_is_spent;
      finish();
    }
  }
  return true;
}

void ControlledFilter::finish() {
  Run& run = *current_;
  run.result.statistics = run.launches.statistics();
  run.result.warnings = run.launches.warnings();
  work_ += work_of(run.result.statistics, model_.reported_dimension());
  finished_.push_back(std::move(run.result));
  current_.reset();
}

const FinishedRun& ControlledFilter::answer() const { return *find(RunRole::level, answer_level()); }
FilterSetup ControlledFilter::answer_setup() const { return plan(RunRole::level, answer_level()).setup; }
FilterSetup ControlledFilter::chosen_setup() const {
  return plan(RunRole::level, std::max(1, answer_level())).setup;
}
ObservationWindows ControlledFilter::answer_windows() const {
  return plan(RunRole::level, answer_level()).windows;
}

// The guard of the answer that did not come to its end, and why.
std::string ControlledFilter::missing_guard() const {
  const int level = answer_level(), guarded = setup_.random || alone() ? level : level - 1;
  for (const auto& [role, name] : guards) {
    if (!applies(role)) continue;
    const FinishedRun* run = find(role, guarded);
    if (run == nullptr || run->failed())
      return fmt::format("the run with {} did not end: {}", name,
                         run == nullptr ? work_is_spent : run->failure);
  }
  return {};
}

// Where the answer is within the tolerance but for a guard that is missing, its error is not known; beyond the
// tolerance it is known to be so.
Accuracy ControlledFilter::accuracy() const {
  Accuracy a;
  a.rows = errors_of(answer_level());
  a.known = !a.rows.empty();
  a.rows.resize(answer().rows.size());
  a.error = largest(a.rows);
  a.reached = a.known && a.error.within(control_.tolerance);
  if (a.reached && !missing_guard().empty()) a.known = a.reached = false;
  return a;
}

std::vector<std::string> ControlledFilter::warnings() const {
  std::vector<std::string> all;
  for (const FilterWarning& w : answer().warnings) all.push_back(w.text);
  const Accuracy a = accuracy();
  if (!a.known) {
    const std::string missing = missing_guard();
    all.push_back("the error is not known: " +
                  (missing.empty() ? "no run of another resolution came to its end" : missing));
  }
  if (a.known && !a.reached) all.push_back(above_tolerance(a.error, control_.tolerance));
  return all;
}

void ControlledFilter::exchange(StateArchive& archive) {
  archive(finished_, windows_done_, work_, time_);
  bool running = current_ != nullptr;
  archive(running);
  if (!running) {
    current_.reset();
    return;
  }
  RunRole role = current_ ? current_->plan.role : RunRole::level;
  int level = current_ ? current_->plan.level : 0;
  archive(role, level);
  if (archive.reading()) {
    StateArchive::require(role <= RunRole::launch_2 && level >= 0 && level <= most_levels + 1);
    current_ = std::make_unique<Run>(model_, plan(role, level));
  }
  archive(current_->next, current_->result.rows);
  current_->launches.exchange(archive);
  StateArchive::require(current_->next <= current_->plan.windows.size());
}

}  // namespace wienertree
