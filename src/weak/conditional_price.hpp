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
#include <optional>

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

  /// E s_T, where it is known: s e^{-rate t} is a martingale if the drift of s is rate s.
  std::optional<double> forward(double T) const;
  /// f(s)/s for large s, if it has a limit and E s_T is known; else 0.
  double slope(const BatchFunction& f, double T) const;
  /// g of what is left of f without its slope times s, plus the slope times E s_T: a call by its put. What the rare
  /// paths of large variance, on which E s_T rests, leave to the steps is then bounded. The weights of leaves must sum
  /// to 1.
  BatchFunction average_of_rest(const BatchFunction& f, const std::vector<BatchFunction>& kinks,
                                double T) const;
  /// The same. Where f is affine in the price between its kinks and jumps, and depends on nothing else, as calls, puts,
  /// digitals and their spreads do, in closed form (affine_pieces.hpp), at a hundredth of the work.
  BatchFunction average_of_rest(const KinkedFunction& f, double T) const;

  /// Where a state of the whole model other than the price is among the tree's.
  std::size_t place(std::size_t state) const { return state < structure_.price->state ? state : state - 1; }

 private:
  SquareRootStructure structure_;
  std::vector<double> start_;
};

}  // namespace wienertree
