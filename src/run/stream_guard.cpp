#include "wienertree/run/stream_guard.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "wienertree/cubature/catalogue.hpp"

namespace wienertree {

StreamGuard::StreamGuard(const Model& model, const FilterSetup& setup, const ControlOptions& control)
    : control_(control),
      answer_(model, setup),
      random_(setup.random),
      closed_form_(!keeps_nodes(setup.options.method) && setup.options.method != FilterMethod::grid) {
  // An unpruned tree grows without end: no room for others.
  if (closed_form_ || setup.options.method == FilterMethod::full_tree) return;
  FilterSetup guard = setup;
  const bool grid = setup.options.method == FilterMethod::grid;
  std::size_t& nodes = grid ? guard.options.grid_points : guard.options.nodes;
  nodes = std::max<std::size_t>(grid ? 64 : 1, nodes / (random_ ? 4 : 2));
  guard.options.substep_tolerance *= 2;
  const std::uint64_t seed = setup.options.seed * 3 + 0x9e3779b97f4a7c15;
  guard.options.seed = seed + 1;
  guards_.emplace_back(model, guard);
  guard.options.seed = seed + 2;
  if (random_) guards_.emplace_back(model, guard);
  if (random_ || guard.options.formula.paths.empty() ||
      guard.options.conditioning == Conditioning::components)
    return;
  if (auto other = other_degree(guard.options.formula.degree, model, control.formulas)) {
    guard.options.formula = *std::move(other);
    guards_.emplace_back(model, guard);
  }
}

void StreamGuard::advance(const ObservationWindow& window) {
  answer_.advance(window);
  for (Launches& guard : guards_) guard.advance(window);
}

AnswerError StreamGuard::summarise(double time, int highest_moment, LaunchesSummary& out) {
  answer_.summarise(time, highest_moment, out);
  const std::vector<LaunchesSummary> answer = {out};
  std::vector<LaunchesSummary> others(guards_.size());
  for (std::size_t g = 0; g < guards_.size(); ++g) guards_[g].summarise(time, 0, others[g]);
  AnswerError error;
  if (closed_form_) error = rounding_error(out.mean);
  if (!others.empty()) error = largest(differences(answer, {others.data(), 1}));
  if (others.size() > 1) {
    const RowErrors second =
        random_ ? differences(answer, {&others[1], 1})
                : differences(std::span<const LaunchesSummary>(others).first(1), {&others[1], 1});
    if (random_)
      error = largest({error, second.front()});
    else
      error += second.front();
  }
  error_ = largest({error_, error});
  return error;
}

std::vector<std::string> StreamGuard::warnings() const {
  std::vector<std::string> all;
  for (const FilterWarning& w : answer_.warnings()) all.push_back(w.text);
  if (!error_known())
    all.emplace_back("the error is not known: nothing of another resolution fits beside this filter");
  else if (!error_.within(control_.tolerance))
    all.push_back(above_tolerance(error_, control_.tolerance));
  return all;
}

void StreamGuard::exchange(StateArchive& archive) {
  answer_.exchange(archive);
  for (Launches& guard : guards_) guard.exchange(archive);
  archive(error_);
}

}  // namespace wienertree
