#pragma once
/// What an unpruned tree costs, and errors that growing a tree can meet.
#include <string>
#include <vector>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/formula.hpp"
#include "wienertree/model/model.hpp"

namespace wienertree {

/// Leaves c^steps from each of `roots` of a formula with c paths, and the bytes of the last two generations
/// with their weights.
struct UnprunedSize {
  double leaves, bytes;
};
UnprunedSize unpruned_size(const CubatureFormula& formula, const Model& model, std::size_t steps,
                           std::size_t roots = 1);

/// @throws InputError with the tree's size and the options that avoid it, if it needs more than
/// `memory_limit` bytes
void refuse_oversized_tree(const CubatureFormula& formula, const Model& model, std::size_t steps,
                           double memory_limit, std::size_t roots = 1);

/// The same for one step from N nodes, whose children are all held at once.
void refuse_oversized_step(const CubatureFormula& formula, const Model& model, std::size_t nodes,
                           double memory_limit);

/// The error of the first failed node. `where` is a step and its time.   @pre !failures.empty()
[[noreturn]] void throw_node_failure(const std::vector<NodeFailure>& failures, const Model& model,
                                     const std::string& where);

/// @throws InputError unless the formula has paths, and as many dimensions as the model has Brownian motions
void check_formula_fits(const CubatureFormula& formula, const Model& model);

}  // namespace wienertree
