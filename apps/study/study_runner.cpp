#include "study_runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <tuple>

#include "../progress.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree::app {
namespace {

struct Task {
  const StudyCell* cell;
  std::size_t path;
  std::uint32_t launch;
};

using Key = std::tuple<std::string, std::string, std::size_t, std::uint32_t>;
Key key_of(const Task& task) { return {task.cell->identity, task.cell->key, task.path, task.launch}; }
Key key_of(const RunRecord& record) { return {record.identity, record.cell, record.path, record.launch}; }

// Each run once, also where two series share it.
std::vector<Task> tasks_of(const std::vector<StudyCell>& cells, std::size_t paths) {
  double runs = 0;
  for (const StudyCell& cell : cells) runs += static_cast<double>(paths) * cell.launches;
  // A task with its key in the set of those known, and its record with a line of text.
  constexpr double bytes_a_run = 600;
  require_memory(bytes_a_run * runs, fmt::format("a study of {:g} runs", runs), "launches, paths");
  std::vector<Task> tasks;
  std::set<Key> known;
  for (const StudyCell& cell : cells)
    for (std::size_t path = 0; path < paths; ++path)
      for (std::uint32_t launch = 0; launch < cell.launches; ++launch)
        if (known.emplace(cell.identity, cell.key, path, launch).second)
          tasks.push_back({&cell, path, launch});
  return tasks;
}

// Processor time of this thread, which other programs on a busy machine do not add to.
double thread_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

RunRecord run_filter_task(const Task& task, StudyData& data) {
  const FilterCell& cell = *task.cell->filter;
  const StudyTruth& truth = data.truth(*task.cell, task.path);
  const ObservationWindows windows = data.windows(cell, data.observations(*task.cell, task.path));
  RunRecord record{task.cell->identity, task.cell->key, task.path, task.launch, {}, truth.values, 0, 0, 0};
  FilterOptions options = cell.setup.options;
  options.launch = task.launch;
  const double began = thread_seconds();
  const auto filter = make_filter(*cell.model, options);
  run_until(*filter, windows, cell.until);
  const Posterior& posterior = filter->posterior();
  record.seconds = thread_seconds() - began;
  record.nodes = static_cast<double>(posterior.kept);
  record.ode_solves = static_cast<double>(filter->statistics().flow.node_segments);
  for (const Quantity& quantity : data.quantities(*task.cell))
    record.value.push_back(quantity_of(quantity, *filter, truth.posterior ? &*truth.posterior : nullptr));
  return record;
}

RunRecord run_weak_task(const Task& task, const Study& study, StudyData& data) {
  RunRecord record{task.cell->identity,
                   task.cell->key,
                   task.path,
                   task.launch,
                   {},
                   data.truth(*task.cell, task.path).values,
                   0,
                   0,
                   0};
  const double began = thread_seconds();
  const WeakOutcome outcome = run_weak_cell(*task.cell->weak, task.launch);
  record.seconds = thread_seconds() - began;
  record.nodes = static_cast<double>(outcome.leaves);
  record.ode_solves = static_cast<double>(outcome.ode_solves);
  for (const std::string& quantity : study.quantities)
    record.value.push_back(number_named(outcome.rows.front(), quantity));
  return record;
}

RunRecord run_task(const Task& task, const Study& study, StudyData& data) {
  const auto where = [&](const Error& error) {
    return fmt::format("{}, path {}, launch {}: {}", task.cell->key, task.path, task.launch, error.where());
  };
  try {
    return task.cell->filter ? run_filter_task(task, data) : run_weak_task(task, study, data);
  } catch (const InputError& error) {
    throw InputError(error.message(), where(error), error.value());
  } catch (const RunError& error) {
    throw RunError(error.message(), where(error), error.value());
  }
}

}  // namespace

std::vector<RunRecord> run_study(const Study& study, const std::vector<StudyCell>& cells, StudyData& data,
                                 StudyJournal& journal, std::size_t threads, bool show_progress) {
  std::map<Key, RunRecord> done;
  for (const RunRecord& record : journal.records()) done.emplace(key_of(record), record);
  const std::vector<Task> all = tasks_of(cells, data.paths());
  std::vector<Task> missing;
  for (const Task& task : all)
    if (!done.contains(key_of(task))) missing.push_back(task);
  {
    std::mutex mutex;
    Progress progress("study", missing.size(), show_progress);
    std::size_t finished = 0;
    ThreadPool pool(threads);
    pool.for_each(missing.size(), [&](std::size_t i, std::size_t) {
      RunRecord record = run_task(missing[i], study, data);
      const std::lock_guard lock(mutex);
      journal.append(record);
      done.emplace(key_of(record), std::move(record));
      progress.advance_to(++finished);
    });
  }
  std::vector<RunRecord> ordered;
  for (const Task& task : all) ordered.push_back(done.at(key_of(task)));
  std::vector<RunRecord> with_others = ordered;
  for (const Task& task : all) done.erase(key_of(task));
  for (const auto& [key, record] : done) with_others.push_back(record);
  journal.rewrite(with_others);
  return ordered;
}

}  // namespace wienertree::app
