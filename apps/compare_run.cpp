#include "compare_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "launches.hpp"
#include "progress.hpp"
#include "window_source.hpp"

namespace wienertree::app {
namespace {

// One model on its way through the record.
struct Lane {
  std::unique_ptr<WindowSource> windows;
  Launches filters;
};

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

std::vector<ComparisonRow> compare(const std::vector<Contender>& contenders, const std::string& observations,
                                   std::optional<std::size_t> steps, bool show_progress) {
  std::vector<ComparisonRow> rows;
  std::size_t total = 0, done = 0;
  std::optional<Progress> progress;
  for (std::size_t m = 0; m < contenders.size(); ++m) {
    const Contender& c = contenders[m];
    Lane lane{open_windows(observations, c.model, steps), Launches(c.model, c.setup)};
    refuse_oversized_tree(c.model, c.setup.options, lane.windows->size());
    if (m == 0) {
      total = lane.windows->size() * contenders.size();
      progress.emplace("compare", total, show_progress);
      if (!lane.windows->observed_at_start())
        rows.push_back({lane.windows->start(), std::vector(contenders.size(), 0.0),
                        std::vector(contenders.size(), 0.0)});
    }
    std::size_t row = rows.empty() || lane.windows->observed_at_start() ? 0 : 1;
    for (ObservationWindow window; lane.windows->next(window); ++row) {
      lane.filters.advance(window);
      progress->advance_to(++done);
      if (m == 0)
        rows.push_back(
            {window.end, std::vector(contenders.size(), 0.0), std::vector(contenders.size(), 0.0)});
      if (row >= rows.size() || rows[row].time != window.end)
        throw InputError("steps to other times than the first model: their timing differs",
                         "model " + c.label, fmt::format("t = {:g}", window.end));
      const std::vector<double> log_evidence = lane.filters.log_evidences();
      rows[row].log_evidence[m] = log_average(log_evidence);
      rows[row].standard_error[m] = standard_error(log_evidence, rows[row].log_evidence[m]);
    }
  }
  return rows;
}

}  // namespace wienertree::app
