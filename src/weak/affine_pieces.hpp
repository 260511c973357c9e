#pragma once
/// Payoffs of a price that are affine between their kinks and jumps.
#include <optional>
#include <vector>

#include "wienertree/model/batch_function.hpp"

namespace wienertree {

/// f(s) = constant_i + slope_i s for r_{i-1} < s < r_i, with r_{-1} = 0 and r_n = infinity.
struct AffinePieces {
  struct Piece {
    double constant = 0, slope = 0;
  };
  std::vector<double> end;    ///< log r_0 < log r_1 < ..
  std::vector<Piece> pieces;  ///< one more than ends

  /// E f(e^{m + S Z}), Z standard normal. With F = e^{m + S^2/2} and the differences D of a piece and the one below it,
  ///
  ///     constant_n + slope_n F - sum_i ( Dconstant_i Phi(z_i) + Dslope_i F Phi(z_i - S) ),   z_i = (log r_i - m)/S
  ///
  /// (Black, Scholes 1973). Counted from above, for the terms in F then are as small as the payoff is bounded.
  double average(double m, double S) const;
};

/// Of a payoff that depends on the price alone; nothing where it is not of this kind. Branches and arguments of kinks are
/// functions of the elementary kind, which are affine everywhere if they are at a dozen places in no special position.
/// @param start a state; the price is at 1e-3 to 1e3 times its value there, and the other states near theirs but not
/// there, also those that start from 0 as integrals do
/// @param logarithmic whether the state is the price's logarithm
std::optional<AffinePieces> affine_pieces(const KinkedFunction& f, const std::vector<double>& start,
                                          std::size_t price, bool logarithmic);

}  // namespace wienertree
