#include <algorithm>
#include <cmath>

#include "wienertree/cubature/flow_methods.hpp"
#include "wienertree/cubature/pair_choice.hpp"
#include "wienertree/cubature/runge_kutta_block.hpp"
#include "wienertree/cubature/runge_kutta_pairs.hpp"
#include "wienertree/cubature/segment_field.hpp"
#include "wienertree/cubature/stiff_nodes.hpp"

namespace wienertree {
namespace {

constexpr std::size_t lanes = RungeKuttaBlock::lanes;

/// A step of length h passes when its error is below tolerance * max(h, shortest_rated): errors of the steps
/// of a segment add up to the tolerance. The floor lets a step across a kink or a jump of the fields pass,
/// whose error per unit of u does not fall with h.
constexpr double shortest_rated = 1.0 / 128;
/// A node is stiff when this many of its accepted steps each left more than so many steps of like length to
/// go.
constexpr int most_crawling_steps = 12;
constexpr double crawling = 200;
/// Bounds on what a node may cost before CVODE is asked: attempts, and the length of a step.
constexpr int most_attempts = 400;
constexpr double shortest = 1e-10;
/// Steps of the pair of order 8 are about this much longer than those of order 5 (measured at 1e-8).
constexpr double low_to_high = 3.5;
/// The usual guards of step size control (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I,
/// II.4).
constexpr double safety = 0.9, smallest_factor = 0.1, largest_factor = 6.0;

/// A node that has not reached the end of the segment.
struct UnfinishedNode {
  std::size_t index = 0;
  double u = 0;                                   // reached so far
  double steps = 1;                               // equal steps planned for the rest
  int attempts = 0, rejections = 0, crawled = 0;  // rejections: since the last accepted step
  double step() const { return (1.0 - u) / steps; }
  void plan(double h) { steps = std::max(1.0, std::ceil((1.0 - u) / h)); }
};

/// Every node has step sizes of its own, from its own error estimates. A block of nodes first tries the whole
/// segment in one step; the nodes that need more are collected from all blocks and integrated together, the
/// places of those that are finished being taken by others. As lanes never mix, what happens to a node is a
/// function of its state and D alone, except for the nodes that end with CVODE: those depend on each other
/// within a block of flow_block.
class ExplicitFlow final : public Flow {
 public:
  ExplicitFlow(const Model& model, FlowTolerance tolerance, int degree)
      : tolerance_(tolerance),
        degree_(degree),
        field_(model),
        block_(field_.dimension(), tolerance),
        low_(cash_karp_5(), block_),
        high_(prince_dormand_8(), block_),
        first_choice_(low_, high_, degree, field_, block_),
        states_(2 * lanes * field_.dimension()),
        stiff_(field_, tolerance) {
    unfinished_.reserve(2 * lanes);
  }

  void move(std::span<const double> D, BatchView x, std::vector<NodeFailure>& failures) override {
    const std::size_t failed_before = failures.size();
    for (std::size_t first = 0; first < x.nodes(); first += lanes) {
      stride(D, x, first, std::min(lanes, x.nodes() - first), failures);
      while (unfinished_.size() >= lanes) step_unfinished(D, x);
    }
    while (!unfinished_.empty()) step_unfinished(D, x);
    stiff_.finish(D, x, failures, statistics_);
    field_.enforce_bounds(x, failures);
    sort_failures(failures, failed_before);
    statistics_.node_segments += x.nodes();
  }

  std::unique_ptr<Flow> clone() const override {
    return make_explicit_flow(field_.model(), tolerance_, degree_);
  }
  std::string_view name() const override { return "explicit"; }

 private:
  enum class Progress { unfinished, finished, stiff };

  void stride(std::span<const double> D, BatchView x, std::size_t first, std::size_t count,
              std::vector<NodeFailure>& failures);
  void step_unfinished(std::span<const double> D, BatchView x);
  Progress advance(UnfinishedNode& node, double squared_error) const;
  void attempt(const RungeKuttaBlock::Method& method, std::span<const double> D, std::size_t n) {
    block_.attempt(method, field_, D, n);
    statistics_.field_evaluations += n * static_cast<std::size_t>(method.pair().stages);
  }
  double* state(std::size_t place) { return states_.data() + place * field_.dimension(); }

  FlowTolerance tolerance_;
  int degree_;
  SegmentField field_;
  RungeKuttaBlock block_;
  RungeKuttaBlock::Method low_, high_;
  PairChoice first_choice_;
  std::vector<UnfinishedNode> unfinished_;
  std::vector<double> states_;  // of the unfinished nodes, one after the other
  StiffNodes stiff_;
};

/// What to multiply a step by, for E^2 = squared and an estimate of order q in h.
double growth(double squared, int q) {
  if (!(squared < 1e30)) return smallest_factor;  // also NaN
  const auto power = -0.5F / static_cast<float>(q);
  const double factor = safety * std::pow(static_cast<float>(std::max(squared, 1e-30)), power);
  return std::clamp(factor, smallest_factor, largest_factor);
}

/// The whole segment in one step, for nodes first .. first+count-1; the others join the unfinished nodes.
void ExplicitFlow::stride(std::span<const double> D, BatchView x, std::size_t first, std::size_t count,
                          std::vector<NodeFailure>& failures) {
  const RungeKuttaBlock::Method& method = first_choice_(D);
  const BatchView here = x.nodes(first, count), start = block_.states(count);
  for (std::size_t i = 0; i < x.components(); ++i)
    std::ranges::copy(here.component(i), start.component(i).begin());
  std::ranges::fill(block_.step_sizes(count), 1.0);
  attempt(method, D, count);
  const ConstBatchView result = block_.results(count);
  const std::span<const double> squared = block_.squared_errors(count);
  const bool all = std::ranges::all_of(squared, [](double e) { return e <= 1.0; });
  if (all) {
    for (std::size_t i = 0; i < x.components(); ++i)
      std::ranges::copy(result.component(i), here.component(i).begin());
    return;
  }
  for (std::size_t n = 0; n < count; ++n) {
    if (squared[n] <= 1.0) {
      for (std::size_t i = 0; i < x.components(); ++i) here(i, n) = result(i, n);
      continue;
    }
    if (std::isnan(squared[n]) && fail_if_not_finite(x, first + n, failures)) continue;
    for (std::size_t i = 0; i < x.components(); ++i) state(unfinished_.size())[i] = here(i, n);
    UnfinishedNode& node = unfinished_.emplace_back();
    node.index = first + n;
    const double h = growth(squared[n], method.pair().estimate_order);
    node.plan(&method == &low_ ? h * low_to_high : h);
  }
}

/// One step of the last unfinished nodes, as many as there are lanes.
void ExplicitFlow::step_unfinished(std::span<const double> D, BatchView x) {
  const std::size_t count = std::min(lanes, unfinished_.size()), first = unfinished_.size() - count;
  const std::size_t d = field_.dimension();
  const BatchView start = block_.states(count);
  for (std::size_t n = 0; n < count; ++n) {
    block_.step_sizes(count)[n] = unfinished_[first + n].step();
    for (std::size_t i = 0; i < d; ++i) start(i, n) = state(first + n)[i];
  }
  attempt(high_, D, count);
  const ConstBatchView result = block_.results(count);
  for (std::size_t n = count; n-- > 0;) {
    const std::size_t place = first + n;
    const double u = unfinished_[place].u;
    const Progress progress = advance(unfinished_[place], block_.squared_errors(count)[n]);
    if (progress == Progress::finished) {
      for (std::size_t i = 0; i < d; ++i) x(i, unfinished_[place].index) = result(i, n);
    } else {
      if (unfinished_[place].u > u)
        for (std::size_t i = 0; i < d; ++i) state(place)[i] = result(i, n);
      if (progress == Progress::unfinished) continue;
      stiff_.add(unfinished_[place].index, 1.0 - unfinished_[place].u, {state(place), d});
    }
    // The last unfinished node, which had its step, takes the place that is free now.
    if (place + 1 != unfinished_.size()) {
      std::copy_n(state(unfinished_.size() - 1), d, state(place));
      unfinished_[place] = unfinished_.back();
    }
    unfinished_.pop_back();
  }
}

ExplicitFlow::Progress ExplicitFlow::advance(UnfinishedNode& node, double squared_error) const {
  const double h = node.step(), rating = h / std::max(h, shortest_rated);
  const double squared = squared_error * rating * rating;
  double factor = growth(squared, high_.pair().estimate_order);
  ++node.attempts;
  if (squared <= 1.0) {
    if (node.steps == 1.0) return Progress::finished;
    node.u += h;
    node.rejections = 0;
    if (factor < 2.0 && (1.0 - node.u) / h > crawling) ++node.crawled;
  } else {
    // An error that does not fall with h as it should comes from a kink, a jump or the edge of the domain.
    factor = std::min(factor, ++node.rejections > 1 ? smallest_factor : safety);
  }
  node.plan(h * factor);
  const bool stiff =
      node.crawled > most_crawling_steps || node.attempts > most_attempts || node.step() < shortest;
  return stiff ? Progress::stiff : Progress::unfinished;
}

}  // namespace

std::unique_ptr<Flow> make_explicit_flow(const Model& model, FlowTolerance tolerance, int degree) {
  return std::make_unique<ExplicitFlow>(model, tolerance, degree);
}

}  // namespace wienertree
