#include "compare_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "progress.hpp"
#include "wienertree/run/launches.hpp"

namespace wienertree::app {
std::vector<double> ComparisonRow::probabilities() const {
  const double all = log_average(log_evidence) + std::log(static_cast<double>(log_evidence.size()));
  std::vector<double> p;
  for (const double l : log_evidence) p.push_back(std::exp(l - all));
  return p;
}

bool Comparison::undecided(std::size_t first, std::size_t second) const {
  const std::vector<double>& l = rows.back().log_evidence;
  return !(std::abs(l[first] - l[second]) > error[first] + error[second]);
}

Comparison compare(const std::vector<Contender>& contenders, const ControlOptions& control,
                   const std::vector<ObservationRows>& records, bool show_progress, SavedRun& saved) {
  const std::size_t models = contenders.size();
  std::vector<ControlledFilter> filters;
  for (std::size_t m = 0; m < models; ++m)
    filters.emplace_back(contenders[m].model, contenders[m].setup, control, records[m]);
  const Exchange exchange = [&](StateArchive& archive) {
    for (ControlledFilter& filter : filters) filter.exchange(archive);
  };
  saved.resume(exchange);
  double time = 0;
  {
    Progress progress("compare", 0, show_progress);
    std::size_t done = 0;
    for (ControlledFilter& filter : filters)
      while (!saved.interrupted() && filter.advance()) {
        time = filter.time();
        progress.advance_to(++done);
        saved.after_step(exchange);
      }
  }
  saved.finish(exchange, fmt::format("t = {:g}", time));
  Comparison result;
  for (const LaunchesSummary& row : filters.front().answer().rows)
    result.rows.push_back({row.mean.time, {}, {}, {}});
  for (std::size_t m = 0; m < models; ++m) {
    const std::vector<LaunchesSummary>& rows = filters[m].answer().rows;
    const Accuracy accuracy = filters[m].accuracy();
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
      if (r >= rows.size() || rows[r].mean.time != result.rows[r].time)
        throw InputError("has rows at other times than the first model: their timing differs",
                         "model " + contenders[m].label, fmt::format("t = {:g}", result.rows[r].time));
      result.rows[r].log_evidence.push_back(rows[r].mean.log_evidence);
      result.rows[r].standard_error.push_back(rows[r].log_evidence_error);
      result.rows[r].error.push_back(accuracy.rows[r].log_evidence);
    }
    result.setup.push_back(filters[m].answer_setup());
    result.warnings.push_back(filters[m].warnings());
    result.error.push_back(accuracy.known ? accuracy.error.log_evidence : INFINITY);
  }
  return result;
}

}  // namespace wienertree::app
