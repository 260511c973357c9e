#pragma once
/// Embedded explicit Runge-Kutta pairs for autonomous equations dx/du = f(x).
///
///     k_i = f(x + h sum_{j<i} a_ij k_j),  i = 1..s,        x_1 = x + h sum_i b_i k_i
///
/// x_1 has order p. Its error per unit of u is estimated by
///
///     |sum_i e_i k_i| = O(h^q),
///
/// which may vanish by accident when a step is so long that its leading term does not dominate: of 10^4 nodes
/// some then pass with a thousand times their tolerance. A second, rougher estimate |g| = |sum_i g_i k_i| of
/// lower order guards against that. With S the size of the slopes it must stay below its own share,
///
///     w |g| (|g| / S)^(r/2 - 1) = O(h^(q' r / 2)),    q' r / 2 > q,
///
/// which for short steps is far below the first. w and r were chosen by experiment, such that the guard
/// refuses few good steps and almost all that passed by accident (see the tests).
///
/// Only the coefficients are here; the tests check the order conditions of every row over all rooted trees.
#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace wienertree {

struct RungeKuttaPair {
  std::string_view name;
  int stages = 0;             ///< s
  int order = 0;              ///< p
  int estimate_order = 0;     ///< q
  std::span<const double> a;  ///< rows 2..s of the strict lower triangle, packed: a_21, a_31, a_32, a_41, ..
  std::span<const double> b;  ///< s
  std::span<const double> e;  ///< s: b - e are weights of order q
  std::span<const double> g;  ///< s: b - g are weights of order q'
  int guard_order = 0;        ///< q'
  int guard_power = 0;        ///< r, 3 or 4
  double guard_weight = 0;    ///< w
  /// a_{i+1,1} .. a_{i+1,i}, for i = 0 .. s-1.
  std::span<const double> row(std::size_t i) const {
    return i == 0 ? a.first(0) : a.subspan(i * (i - 1) / 2, i);
  }
};

/// Order 5 by six stages, error estimate of order 4; the guard is their embedded formula of order 3 (Cash,
/// Karp 1990, A variable order Runge-Kutta method for initial value problems with rapidly varying right-hand
/// sides, ACM Trans. Math. Softw. 16, 201-222).
const RungeKuttaPair& cash_karp_5();

/// Order 8 by thirteen stages, error estimate of order 7: RK8(7)13M (Prince, Dormand 1981, High order
/// embedded Runge-Kutta formulae, J. Comput. Appl. Math. 7, 67-75). The guard is the quadrature of degree 3
/// on the stages at c = 0, c_9, 13/20, 1.
const RungeKuttaPair& prince_dormand_8();

}  // namespace wienertree
