#pragma once
/// The flow of one node in extended precision, by a method none of the library's flows uses.
#include <functional>
#include <vector>

namespace wienertree::test {

using ExtendedField = std::function<void(const long double* x, long double* out)>;

/// dx/du = f(x) over [0, 1] by Gragg-Bulirsch-Stoer extrapolation of the modified midpoint rule with 2, 4,
/// .., 20 substeps (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9) in long double
/// (64 bits of mantissa on x86-64). Steps are halved until the last two rows of the extrapolation agree to
/// 1e-16.
/// @throws std::runtime_error when that takes steps below 1e-9
std::vector<double> reference_flow(const ExtendedField& field, const std::vector<double>& start);

}  // namespace wienertree::test
