#include "wienertree/tree/growth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>

#include "wienertree/numeric/buffer.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr std::size_t nodes_a_task = 16 * flow_block;
constexpr std::size_t most_branches = std::size_t{1} << 16;

// Parents in a block: enough that what a call costs is spread thin, few enough that they stay in cache with
// their children and that there are blocks for many threads; and a number that does not depend on the
// threads.
std::size_t parents_a_block(std::size_t parents, std::size_t branches) {
  constexpr std::size_t least = 8;
  return std::clamp(parents / (16 * flow_block), least, std::max(least, 192 / branches)) * flow_block;
}

void shape_children(const Generation& parents, const CubatureFormula& formula, double s,
                    Generation& children) {
  const std::size_t branches = formula.paths.size(), nodes = parents.size();
  assert(parents.log_weight.size() == nodes);
  if (branches == 0 || branches > most_branches)
    throw InputError(fmt::format("a formula needs between 1 and {} paths", most_branches), formula.name,
                     fmt::format("{}", branches));
  if (nodes > std::numeric_limits<std::uint32_t>::max() / branches)
    throw InputError(
        fmt::format("{} nodes along {} paths are too many children for 32-bit indices", nodes, branches),
        "tree");
  const std::size_t total = nodes * branches;
  children.time = parents.time + s;
  children.states.reshape(parents.states.components(), total);
  resize_unspecified(children.log_weight, total);
  resize_unspecified(children.log_likelihood, parents.log_likelihood.empty() ? 0 : total);
  resize_unspecified(children.parent, total);
  resize_unspecified(children.branch, total);
  children.count.clear();
}

// Copies nodes first .. first+count-1 of the parents to their places along one branch.
void plant(const Generation& parents, std::size_t branch, double log_lambda, std::size_t first,
           std::size_t count, Generation& children) {
  const std::size_t at = branch * parents.size() + first;
  for (std::size_t i = 0; i < parents.states.components(); ++i)
    std::copy_n(&parents.states.component(i)[first], count, &children.states.component(i)[at]);
  for (std::size_t n = 0; n < count; ++n) {
    children.log_weight[at + n] = parents.log_weight[first + n] + log_lambda;
    children.parent[at + n] = static_cast<std::uint32_t>(first + n);
    children.branch[at + n] = static_cast<std::uint16_t>(branch);
  }
  if (!parents.log_likelihood.empty())
    std::copy_n(&parents.log_likelihood[first], count, &children.log_likelihood[at]);
}

template <class T>
void gather(std::span<const T> from, std::span<const std::uint32_t> site, std::span<T> to,
            ThreadPool* threads) {
  for_blocks(threads, site.size(), nodes_a_task, [&](std::size_t first, std::size_t count, std::size_t) {
    for (std::size_t k = first; k < first + count; ++k) to[k] = from[site[k]];
  });
}

template <class T>
void copy_column(const std::vector<T>& from, Buffer<T>& to, ThreadPool* threads) {
  resize_unspecified(to, from.size());
  for_blocks(threads, from.size(), nodes_a_task, [&](std::size_t first, std::size_t count, std::size_t) {
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), count,
                to.begin() + static_cast<std::ptrdiff_t>(first));
  });
}

template <class T>
void gather(const Buffer<T>& from, std::span<const std::uint32_t> site, Buffer<T>& to, ThreadPool* threads) {
  resize_unspecified(to, from.empty() ? 0 : site.size());
  if (!from.empty()) gather(std::span<const T>(from), site, std::span<T>(to), threads);
}

void copy_states(const Batch& from, Batch& to) {
  to.reshape(from.components(), from.nodes());
  for (std::size_t i = 0; i < from.components(); ++i) {
    const auto x = from.component(i);
    std::copy(x.begin(), x.end(), to.component(i).begin());
  }
}

}  // namespace

namespace {

void require_flows(std::span<const std::unique_ptr<Flow>> flows, const ThreadPool& threads) {
  if (flows.size() < threads.size())
    throw InputError(fmt::format("{} threads need as many flows", threads.size()), "tree",
                     fmt::format("{}", flows.size()));
}

void sort_by_node(std::vector<NodeFailure>& failures) {
  std::sort(failures.begin(), failures.end(),
            [](const NodeFailure& a, const NodeFailure& b) { return a.node < b.node; });
}

// A run of children along one branch.
struct Run {
  std::size_t branch, first, count;
};

// The chosen children, branch by branch: their parents, weights and counts, and the runs to be moved.
std::vector<Run> plant_chosen(const Generation& parents, std::size_t branches, double s,
                              const Selection& chosen, Generation& children) {
  const std::size_t nodes = parents.size(), total = chosen.site.size();
  std::vector<std::size_t> end(branches + 1, 0);
  for (const std::uint32_t site : chosen.site) {
    if (site >= branches * nodes)
      throw InputError(fmt::format("a selected site is not one of {} children", branches * nodes),
                       "selection", fmt::format("{}", site));
    ++end[site / nodes + 1];
  }
  for (std::size_t j = 0; j < branches; ++j) end[j + 1] += end[j];
  std::vector<Run> runs;
  for (std::size_t j = 0; j < branches; ++j)
    for (std::size_t first = end[j]; first < end[j + 1]; first += nodes_a_task)
      runs.push_back({j, first, std::min(nodes_a_task, end[j + 1] - first)});
  children.time = parents.time + s;
  children.states.reshape(parents.states.components(), total);
  resize_unspecified(children.log_weight, total);
  resize_unspecified(children.log_likelihood, parents.log_likelihood.empty() ? 0 : total);
  resize_unspecified(children.parent, total);
  resize_unspecified(children.branch, total);
  resize_unspecified(children.count, chosen.count.size());
  std::vector<std::size_t>& place = end;  // of the next child of each branch
  for (std::size_t k = 0; k < total; ++k) {
    const std::size_t branch = chosen.site[k] / nodes, parent = chosen.site[k] % nodes, at = place[branch]++;
    children.log_weight[at] = chosen.log_weight[k];
    children.parent[at] = static_cast<std::uint32_t>(parent);
    children.branch[at] = static_cast<std::uint16_t>(branch);
    if (!chosen.count.empty()) children.count[at] = chosen.count[k];
    if (!parents.log_likelihood.empty()) children.log_likelihood[at] = parents.log_likelihood[parent];
    for (std::size_t i = 0; i < parents.states.components(); ++i)
      children.states(i, at) = parents.states(i, parent);
  }
  return runs;
}

}  // namespace

void grow_chosen(const Generation& parents, const CubatureFormula& formula, double s, const Selection& chosen,
                 std::span<const std::unique_ptr<Flow>> flows, ThreadPool& threads, Generation& children,
                 std::vector<NodeFailure>& failures) {
  require_flows(flows, threads);
  const std::vector<Run> runs = plant_chosen(parents, formula.paths.size(), s, chosen, children);
  failures.clear();
  std::mutex failures_mutex;
  threads.for_each(runs.size(), [&](std::size_t task, std::size_t thread) {
    const Run& run = runs[task];
    std::vector<NodeFailure> failed;
    flows[thread]->move_along(formula.paths[run.branch], s,
                              children.states.view().nodes(run.first, run.count), failed);
    if (failed.empty()) return;
    for (NodeFailure& f : failed) f.node += run.first;
    const std::lock_guard lock(failures_mutex);
    failures.insert(failures.end(), failed.begin(), failed.end());
  });
  sort_by_node(failures);
}

void grow(const Generation& parents, const CubatureFormula& formula, double s,
          std::span<const std::unique_ptr<Flow>> flows, ThreadPool& threads, Generation& children,
          std::vector<NodeFailure>& failures, FamilyVisitor* visitor) {
  require_flows(flows, threads);
  shape_children(parents, formula, s, children);
  failures.clear();
  std::mutex failures_mutex;
  const auto grow_branch = [&](std::size_t branch, std::size_t first, std::size_t count, std::size_t thread) {
    const CubaturePath& path = formula.paths[branch];
    const std::size_t at = branch * parents.size() + first;
    plant(parents, branch, std::log(path.weight), first, count, children);
    std::vector<NodeFailure> failed;
    flows[thread]->move_along(path, s, children.states.view().nodes(at, count), failed);
    if (failed.empty()) return;
    for (NodeFailure& f : failed) {
      for (std::size_t i = 0; i < parents.states.components(); ++i)
        children.states(i, at + f.node) = parents.states(i, first + f.node);
      f.node += at;
    }
    const std::lock_guard lock(failures_mutex);
    failures.insert(failures.end(), failed.begin(), failed.end());
  };
  const std::size_t branches = formula.paths.size();
  const std::size_t nodes = parents.size(), block = parents_a_block(nodes, branches);
  const std::size_t blocks = (nodes + block - 1) / block;
  const auto count_from = [&](std::size_t first) { return std::min(block, nodes - first); };
  if (visitor == nullptr)
    threads.for_each(blocks * branches, [&](std::size_t task, std::size_t thread) {
      const std::size_t first = task / branches * block;
      grow_branch(task % branches, first, count_from(first), thread);
    });
  else
    threads.for_each(blocks, [&](std::size_t task, std::size_t thread) {
      const std::size_t first = task * block, count = count_from(first);
      visitor->parents(first, count, thread);
      for (std::size_t branch = 0; branch < branches; ++branch) {
        grow_branch(branch, first, count, thread);
        visitor->children(first, branch * nodes + first, count, thread);
      }
    });
  sort_by_node(failures);
}

TreeGrower::TreeGrower(const Model& model, FlowMethod method, FlowTolerance tolerance,
                       CubatureFormula formula, std::size_t threads)
    : TreeGrower(make_flow(method, model, tolerance, formula.degree), std::move(formula), threads) {}

TreeGrower::TreeGrower(std::unique_ptr<Flow> flow, CubatureFormula formula, std::size_t threads)
    : formula_(std::move(formula)), threads_(threads) {
  flows_.push_back(std::move(flow));
  while (flows_.size() < threads) flows_.push_back(flows_.front()->clone());
}

FlowStatistics TreeGrower::statistics() const {
  FlowStatistics total;
  for (const auto& flow : flows_) total += flow->statistics();
  return total;
}

void select(const Generation& children, const Selection& selection, Generation& survivors,
            ThreadPool* threads) {
  const std::span<const std::uint32_t> site = selection.site;
  const std::size_t kept = site.size(), d = children.states.components();
  assert(selection.log_weight.size() == kept && &children != &survivors);
  for_blocks(threads, kept, nodes_a_task, [&](std::size_t first, std::size_t count, std::size_t) {
    for (const std::uint32_t i : site.subspan(first, count))
      if (i >= children.size())
        throw InputError(fmt::format("a selected site is not one of {} children", children.size()),
                         "selection", fmt::format("{}", i));
  });
  survivors.time = children.time;
  if (selection.moved_states.nodes() != 0) {
    assert(selection.moved_states.nodes() == kept && selection.moved_states.components() == d);
    copy_states(selection.moved_states, survivors.states);
  } else {
    survivors.states.reshape(d, kept);
    for (std::size_t i = 0; i < d; ++i)
      gather(children.states.component(i), site, survivors.states.component(i), threads);
  }
  copy_column(selection.log_weight, survivors.log_weight, threads);
  copy_column(selection.count, survivors.count, threads);
  gather(children.log_likelihood, site, survivors.log_likelihood, threads);
  gather(children.parent, site, survivors.parent, threads);
  gather(children.branch, site, survivors.branch, threads);
}

void copy_generation(const Generation& from, Generation& to) {
  to.time = from.time;
  copy_states(from.states, to.states);
  to.log_weight = from.log_weight;
  to.log_likelihood = from.log_likelihood;
  to.parent = from.parent;
  to.branch = from.branch;
  to.count = from.count;
}

}  // namespace wienertree
