#pragma once
/// The memory that a filter takes, before it is taken.
#include "wienertree/filter/filter.hpp"

namespace wienertree {

/// Bytes that a filter of these options holds during a step, to about a factor of two: its nodes before and after the
/// step, their weights, and what thinning works with. An unpruned tree: of its first step; refuse_oversized_tree tells
/// of later ones.
double filter_bytes(const Model& model, const FilterOptions& options);

/// @throws InputError naming the option that asks for too much, if `launches` such filters need more than
/// options.memory_limit
void refuse_oversized_filter(const Model& model, const FilterOptions& options, std::size_t launches = 1);

}  // namespace wienertree
