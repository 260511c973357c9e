#include "wienertree/filter/filter_memory.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "wienertree/thinning/recombination/recombination.hpp"
#include "wienertree/tree/tree_size.hpp"

namespace wienertree {
namespace {

// Doubles and indices that weights, their normalised form, orders and counts take, a node.
constexpr double bytes_of_weights = 64;
// The grid filter: one density has about 30 vectors of its length, and each of seven complex poles a band of 27
// entries with its factors.
constexpr double bytes_a_cell = 30 * 8 + 7 * 2 * 27 * 16;

}  // namespace

double filter_bytes(const Model& model, const FilterOptions& options) {
  const auto d = static_cast<double>(model.state_dimension()), N = static_cast<double>(options.nodes);
  switch (options.method) {
    case FilterMethod::klv:
    case FilterMethod::full_tree: {
      const std::size_t roots = options.thinning.method == ThinningMethod::none ? 1 : options.nodes;
      const UnprunedSize children = unpruned_size(options.formula, model, 1, roots);
      const double patch = options.thinning.method == ThinningMethod::levelwise
                               ? levelwise_bytes(model.state_dimension(), options.nodes)
                               : 0;
      return children.bytes + children.leaves * (8 * d + bytes_of_weights) + patch;
    }
    case FilterMethod::euler:
    case FilterMethod::weighted:
      return N * (2 * 8 * d + bytes_of_weights);
    case FilterMethod::gaussian_mixture:
      return N * (2 * 8 * (d + d * d) + bytes_of_weights);
    case FilterMethod::grid:
      return static_cast<double>(options.grid_points) * bytes_a_cell;
    case FilterMethod::benes:
      return 0;
    case FilterMethod::kalman_bucy:
    case FilterMethod::kalman:
      return 64 * 8 * d * d;
  }
  return 0;
}

void refuse_oversized_filter(const Model& model, const FilterOptions& options, std::size_t launches) {
  const bool grid = options.method == FilterMethod::grid;
  std::string what =
      fmt::format("a filter of {} {}", grid ? options.grid_points : options.nodes, grid ? "cells" : "nodes");
  if (launches > 1) what = fmt::format("{} launches of {}", launches, what);
  require_memory(static_cast<double>(launches) * filter_bytes(model, options), options.memory_limit, what,
                 "--nodes");
}

}  // namespace wienertree
