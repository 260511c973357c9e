#include "wienertree/run/launches.hpp"

#include <algorithm>
#include <cmath>

namespace wienertree {
namespace {

// Average over the launches of one number of each.
template <class Get>
double average(const std::vector<PosteriorSummary>& launches, Get get) {
  double sum = 0;
  for (const PosteriorSummary& s : launches) sum += get(s);
  return sum / static_cast<double>(launches.size());
}

// Sample standard deviation, 0 for one launch.
template <class Get>
double deviation(const std::vector<PosteriorSummary>& launches, Get get) {
  if (launches.size() < 2) return 0;
  const double centre = average(launches, get);
  const double square =
      average(launches, [&](const PosteriorSummary& s) { return (get(s) - centre) * (get(s) - centre); });
  const auto m = static_cast<double>(launches.size());
  return std::sqrt(square * m / (m - 1));
}

}  // namespace

void exchange(StateArchive& archive, LaunchesSummary& s) {
  archive(s.mean, s.nodes, s.mean_sd, s.log_evidence_sd, s.log_evidence_error, s.ratio);
}

double log_average(std::span<const double> logarithms) {
  const double largest = *std::max_element(logarithms.begin(), logarithms.end());
  if (largest == -INFINITY) return largest;
  double sum = 0;
  for (const double l : logarithms) sum += std::exp(l - largest);
  return largest + std::log(sum / static_cast<double>(logarithms.size()));
}

Launches::Launches(const Model& model, const FilterSetup& setup)
    : components_(model.reported_dimension()), summaries_(setup.launches) {
  FilterOptions options = setup.options;
  for (options.launch = 0; options.launch < setup.launches; ++options.launch)
    filters_.push_back(make_filter(model, options));
}

void Launches::advance(const ObservationWindow& window) {
  for (const auto& filter : filters_) filter->advance(window);
}

void Launches::summarise(double time, int highest_moment, LaunchesSummary& out) {
  for (std::size_t m = 0; m < filters_.size(); ++m)
    wienertree::summarise(filters_[m]->posterior(), components_, highest_moment, summaries_[m]);
  out.ratio = average_ratio();
  out.mean = summaries_.front();
  out.mean.time = time;
  out.nodes = static_cast<double>(out.mean.nodes);
  out.mean_sd.assign(components_, 0.0);
  out.log_evidence_sd = out.log_evidence_error = 0;
  if (filters_.size() == 1) return;
  for (std::size_t i = 0; i < components_; ++i) {
    for (auto part : {&PosteriorSummary::mean, &PosteriorSummary::sd, &PosteriorSummary::q05,
                      &PosteriorSummary::q50, &PosteriorSummary::q95})
      (out.mean.*part)[i] = average(summaries_, [&](const PosteriorSummary& s) { return (s.*part)[i]; });
    for (std::size_t k = 0; k < (out.mean.moments.empty() ? 0 : out.mean.moments[i].size()); ++k)
      out.mean.moments[i][k] =
          average(summaries_, [&](const PosteriorSummary& s) { return s.moments[i][k]; });
    out.mean_sd[i] = deviation(summaries_, [&](const PosteriorSummary& s) { return s.mean[i]; });
  }
  const auto log_evidence = [](const PosteriorSummary& s) { return s.log_evidence; };
  std::vector<double> log_evidences;
  for (const PosteriorSummary& s : summaries_) log_evidences.push_back(s.log_evidence);
  out.mean.log_evidence = log_average(log_evidences);
  out.log_evidence_sd = deviation(summaries_, log_evidence);
  const auto M = static_cast<double>(filters_.size());
  double squares = 0;
  for (const double l : log_evidences) squares += std::pow(std::expm1(l - out.mean.log_evidence), 2);
  out.log_evidence_error = std::sqrt(squares / (M - 1) / M);
  out.mean.ess = average(summaries_, [](const auto& s) { return s.ess; });
  out.nodes = average(summaries_, [](const auto& s) { return static_cast<double>(s.nodes); });
}

void Launches::exchange(StateArchive& archive) {
  for (const auto& filter : filters_) filter->exchange(archive);
}

std::optional<LikelihoodRatio> Launches::average_ratio() {
  std::vector<double> log_mean, log_variance;
  LikelihoodRatio average;
  for (const auto& filter : filters_) {
    const std::optional<LikelihoodRatio> ratio = filter->likelihood_ratio();
    if (!ratio) return {};
    log_mean.push_back(ratio->log_mean);
    log_variance.push_back(ratio->log_variance);
    average.effective_size += ratio->effective_size / static_cast<double>(filters_.size());
  }
  average.log_mean = log_average(log_mean);
  average.log_variance = log_average(log_variance);
  return average;
}

std::vector<FilterWarning> Launches::warnings() const {
  std::vector<FilterWarning> all;
  for (const auto& filter : filters_)
    for (const FilterWarning& w : filter->warnings())
      if (std::ranges::none_of(all, [&](const FilterWarning& known) { return known.kind == w.kind; }))
        all.push_back(w);
  return all;
}

FilterStatistics Launches::statistics() const {
  FilterStatistics all;
  for (const auto& filter : filters_) {
    const FilterStatistics& s = filter->statistics();
    all.flow += s.flow;
    all.steps = s.steps;
    all.children += s.children;
    all.dropped_nodes += s.dropped_nodes;
    all.conditioned += s.conditioned;
    all.discarded += s.discarded;
  }
  return all;
}

}  // namespace wienertree
