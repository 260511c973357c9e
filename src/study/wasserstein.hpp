#pragma once
/// The Wasserstein-1 distance of two posteriors in one component.
#include <cstddef>

#include "wienertree/filter/posterior.hpp"

namespace wienertree {

/// W_1(a, b) = int |F_a(x) - F_b(x)| dx, F the distribution functions of component i (Vallender 1974).
///
/// Sums of Dirac masses and of Gaussians are taken as they are, without smoothing. Between two neighbouring
/// atoms F_a - F_b is a constant plus a difference of Gaussian distribution functions, whose antiderivative
/// is known: exact up to rounding where at most one of the two laws is smooth. Where both are, the line is
/// cut into cells of at most 1/100 of the narrower Gaussian's standard deviation (but no more than 20000),
/// and a cell in which the difference changes sign more than once contributes an error of the order of the
/// square of its width.
/// @pre i < components of both
double wasserstein(const Posterior& a, const Posterior& b, std::size_t i);

}  // namespace wienertree
