#pragma once
/// The normal law of a price's logarithm given its variances (model/square_root.hpp).
#include <vector>

#include "wienertree/model/square_root.hpp"
#include "wienertree/numeric/batch.hpp"

namespace wienertree {

struct NormalLaw {
  double mean = 0, deviation = 0;
};

class GivenVariances {
 public:
  /// @param structure with a price   @param start the states at time 0, the price among them
  GivenVariances(SquareRootStructure structure, const std::vector<double>& start, double T);

  /// Of log u_T, from the states of leaf n: those of `start` without the price, then the integral of each component.
  NormalLaw operator()(ConstBatchView leaves, std::size_t n) const;

 private:
  SquareRootStructure structure_;
  std::size_t states_;
  double mean_;
  std::vector<double> of_component_, of_integral_;
};

}  // namespace wienertree
