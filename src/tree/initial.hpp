#pragma once
/// The first generation of a tree.
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/random.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// A fixed start is one node. A Gaussian start N(m, P) of rank r is a tensor grid along the principal axes
/// with about `nodes`^{1/r} equidistant points an axis over +-`reach` standard deviations, weighted by the
/// density: the trapezoidal rule, which converges geometrically in the number of points for analytic
/// integrands (Trefethen, Weideman 2014). With fewer than 10 points an axis the degree-5 Gaussian cubature
/// takes its place.
/// At least 1000 points are laid where N is smaller: a first observation may be much sharper than the start,
/// and thinning comes after it.
/// @param nodes N >= 1   @throws InputError if the covariance is not positive semidefinite
Generation first_generation(const Model& model, std::size_t nodes);

/// N independent draws of the start.   x is reshaped to d x N.   @throws InputError as above
void draw_initial(const Model& model, const RandomStream& random, std::size_t nodes, Batch& x);

}  // namespace wienertree
