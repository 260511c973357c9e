#pragma once
/// Time grids for the iterated KLV operator.
#include <cstddef>
#include <vector>

namespace wienertree {

enum class GridKind { uniform, kusuoka };

/// t_0 = 0 < t_1 < .. < t_n = T. Uniform: t_i = T i/n. Kusuoka (2001): t_i = T (1 - (1 - i/n)^gamma), whose
/// steps shrink towards T; with gamma > m - 1 the operator of degree m converges at order (m-1)/2 in n even
/// if the payoff is only Lipschitz.
/// @throws InputError unless T > 0 is finite, n >= 1 and gamma > 0, and where the times do not increase in doubles
std::vector<double> time_grid(GridKind kind, double T, std::size_t n, double gamma);

}  // namespace wienertree
