#pragma once
/// How likely two states are together: lambda(x, xi) of the weighted particle filter.
#include "wienertree/model/observation_density.hpp"

namespace wienertree {

/// lambda = int g(y - a) g(y - b) / g(y) dy for one component of noise, a = h(x), b = h(xi): the expectation,
/// if y were noise alone, of the product of the two states' likelihood ratios. With the noise's scale s:
///
///     gaussian        exp(a b / s^2)
///     laplace         a, b of one sign, u <= v their |.|/s:   e^u + (e^{-u-v} - e^{2u-v})/3
///                     of different signs:                     e^{-u} + e^{-v} - e^{-u-v}
///     log_chi_square  e^{-(a+b)/2} / sqrt(e^{-a} + e^{-b} - 1), infinite where the radicand is not positive
///     student_t       by quadrature
double noise_overlap(const NoiseLaw& law, double a, double b);

/// The same by quadrature (double exponential, Takahasi, Mori 1974) for every law, to about 1e-9 relative.
/// @throws RunError if the integral does not converge
double noise_overlap_by_quadrature(const NoiseLaw& law, double a, double b);

}  // namespace wienertree
