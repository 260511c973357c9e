#include "compare_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "progress.hpp"
#include "wienertree/run/launches.hpp"
#include "wienertree/run/window_source.hpp"

namespace wienertree::app {
namespace {

// The error of the logarithm of an average of M: sd(Z)/(mean(Z) sqrt(M)), from the launches' Z relative to
// their mean.
double standard_error(const std::vector<double>& log_evidence, double log_mean) {
  const auto M = static_cast<double>(log_evidence.size());
  if (log_evidence.size() < 2) return 0;
  double squares = 0;
  for (const double l : log_evidence) squares += std::pow(std::expm1(l - log_mean), 2);
  return std::sqrt(squares / (M - 1) / M);
}

}  // namespace

std::vector<double> ComparisonRow::probabilities() const {
  const double all = log_average(log_evidence) + std::log(static_cast<double>(log_evidence.size()));
  std::vector<double> p;
  for (const double l : log_evidence) p.push_back(std::exp(l - all));
  return p;
}

std::vector<ComparisonRow> compare(const std::vector<Contender>& contenders,
                                   const std::vector<std::unique_ptr<WindowSource>>& windows,
                                   bool show_progress, SavedRun& saved) {
  const std::size_t models = contenders.size(), steps = windows.front()->size();
  const bool starts_before = !windows.front()->observed_at_start();
  const std::vector<double> zeros(models, 0.0);
  std::vector<ComparisonRow> rows;
  if (starts_before) rows.push_back({windows.front()->start(), zeros, zeros});
  const std::size_t first = rows.size();
  std::vector<Launches> filters;
  for (std::size_t m = 0; m < models; ++m) {
    refuse_oversized_tree(contenders[m].model, contenders[m].setup.options, windows[m]->size());
    filters.emplace_back(contenders[m].model, contenders[m].setup);
  }
  const Exchange exchange = [&](StateArchive& archive) {
    archive(rows);
    for (std::size_t m = 0; m < models; ++m) {
      windows[m]->exchange(archive);
      filters[m].exchange(archive);
    }
  };
  saved.resume(exchange);
  Progress progress("compare", steps, show_progress);
  while (rows.size() - first < steps && !saved.interrupted()) {
    for (std::size_t m = 0; m < models; ++m) {
      ObservationWindow window;
      const bool there = windows[m]->next(window);
      if (m == 0) rows.push_back({window.end, zeros, zeros});
      if (!there || rows.back().time != window.end)
        throw InputError("steps to other times than the first model: their timing differs",
                         "model " + contenders[m].label, fmt::format("t = {:g}", rows.back().time));
      filters[m].advance(window);
      const std::vector<double> log_evidence = filters[m].log_evidences();
      rows.back().log_evidence[m] = log_average(log_evidence);
      rows.back().standard_error[m] = standard_error(log_evidence, rows.back().log_evidence[m]);
    }
    progress.advance_to(rows.size() - first);
    saved.after_step(exchange);
  }
  saved.finish(exchange, fmt::format("t = {:g}", rows.back().time));
  return rows;
}

}  // namespace wienertree::app
