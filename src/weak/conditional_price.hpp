#pragma once
/// Payoffs of a price that is lognormal given its variances.
///
/// With the variances' paths given, the log u of a price of Heston's kind is Gaussian: its mean and variance are
/// affine in the variances at T and their integrals (model/square_root.hpp; the mixing formula of Willard 1997,
/// "Calculating prices and sensitivities for path-independent derivative securities in multifactor models",
/// J. Derivatives 5). The tree then need not carry the price: a payoff f(s, v) becomes
///
///     g(v, I) = int f(exp(m + S z), v) phi(z) dz,
///
/// by Gauss-Legendre quadrature between the kinks and jumps of f, which makes g smooth.
#include "wienertree/model/batch_function.hpp"
#include "wienertree/model/square_root.hpp"

namespace wienertree {

class ConditionalPrice {
 public:
  /// @param structure of the whole model, with a price, d states in all; the tree has these states without the
  /// price, then int_0^t w_k for each component k
  /// @param start the d states at time 0
  ConditionalPrice(SquareRootStructure structure, std::vector<double> start);

  /// g at time T, of states of the tree.
  /// @param kinks functions of the d states at whose zeros f has kinks or jumps
  BatchFunction average(const BatchFunction& f, const std::vector<BatchFunction>& kinks, double T) const;

  /// Where a state of the whole model other than the price is among the tree's.
  std::size_t place(std::size_t state) const { return state < structure_.price->state ? state : state - 1; }

 private:
  SquareRootStructure structure_;
  std::vector<double> start_;
};

}  // namespace wienertree
