#pragma once
/// Thinning that is finest along one direction.
///
/// A payoff with a kink, or one that bends quickly, is a function of a few arguments of the state: E f(X_T)
/// is kept far better if the patches of a recombination are thin along the value that the argument will take,
/// and wide across it. The sites are cut into slabs of equal mass along that value, and each slab is thinned
/// by itself with its share of the budget.
#include <cstdint>
#include <vector>

#include "wienertree/thinning/thinning.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

class Slabs {
 public:
  /// How many slabs share N nodes in d >= 2 dimensions: at most 8, of 120 nodes or more, which keep moments
  /// of degree 4, for d = 2; at most 24, of 60 or more, which keep some of degree 2, for d > 2. Further nodes
  /// make the patches of every slab smaller in all directions; slabs that became thinner for ever, their
  /// patches as wide across, would leave an error that does not fall with N.
  static std::size_t number(std::size_t dimension, std::size_t budget);

  /// @param value one a site, the direction
  /// @param budget N >= 1, shared by the slabs
  /// @param deviation see Sites; may be empty
  void thin(const Generation& sites, const std::vector<double>& value, std::size_t budget,
            const RandomStream& random, Thinning& thinning, Selection& out, ConstBatchView deviation = {});

 private:
  std::vector<std::uint32_t> order_;
  std::vector<double> weight_;
  Batch states_, deviation_;
  Selection part_;
};

}  // namespace wienertree
