#pragma once
/// Thinning that is finest along one direction.
///
/// A payoff with a kink, or one that bends quickly, is a function of a few arguments of the state: E f(X_T)
/// is kept far better if the patches of a recombination are thin along the value that the argument will take,
/// and wide across it. The sites are cut into slabs of equal mass along that value, and each slab is thinned
/// by itself with its share of the budget.
#include <cstdint>
#include <vector>

#include "wienertree/tree/generation.hpp"
#include "wienertree/tree/thinning.hpp"

namespace wienertree {

class Slabs {
 public:
  /// Nodes a slab should keep: enough for some patches with moments of degree 2 in 3 dimensions, few enough
  /// for slabs of a twentieth of the mass with a thousand nodes.
  static constexpr std::size_t nodes_a_slab = 50;

  /// @param value one a site, the direction
  /// @param budget N >= 1, shared by N / nodes_a_slab slabs
  void thin(const Generation& sites, const std::vector<double>& value, std::size_t budget,
            const RandomStream& random, Thinning& thinning, Selection& out);

 private:
  std::vector<std::uint32_t> order_;
  std::vector<double> weight_;
  Batch states_;
  Selection part_;
};

}  // namespace wienertree
