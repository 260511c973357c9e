#pragma once
/// Patched recombination (Litterer, Lyons 2012, "High order recombination and an application to cubature on
/// Wiener space", Ann. Appl. Probab. 22, 1301-1327): the sites are cut into patches that are small in space,
/// and in each patch the measure is replaced by one on few nodes with the same moments.
#include <cstddef>
#include <memory>

#include "wienertree/thinning/thinning.hpp"

namespace wienertree {

/// Deterministic; keeps the total mass; at most `budget` nodes. `budget` sites or fewer are all kept as they
/// are. The sites are first put into lexicographic order, so that the result depends on the measure and not
/// on how it is stored.
///
/// One component varies over the sites (the others, a clock for instance, are constant): every patch becomes
/// its Gauss quadrature of s nodes, which has the patch's moments up to degree 2s - 1 and moves the nodes
/// (Selection::moved_states). `degree` r > 0 asks for s = [r/2] + 1; r = 0 chooses s from the budget.
///
/// Several vary: in every patch at most q = (d+r choose r) of its sites are kept, with the patch's moments up
/// to degree r, by Caratheodory's theorem. r = 0 chooses r by `recombination_degree`; a given r is lowered
/// until q <= budget. With a budget below 1 + d no moment but the mass can be kept: the mass of every patch
/// goes to the site nearest to its mean.
///
/// Patch coordinates are the components, shifted and scaled so that the patch's bounding box is [-1,1]^d, and
/// moments are those of products of Legendre polynomials; they are kept to 1e-12 of the patch's mass. Sites
/// of less than 1e-300 of the heaviest of their patch may be left out, their mass being that of a rounding
/// error.
///
/// `thin` throws InputError if states and log-weights differ in number or the budget is 0, and RunError if a
/// log-weight is NaN or +infinity, none is positive, or a site of positive weight has a state that is not
/// finite.
/// @throws InputError if degree < 0
std::unique_ptr<Thinning> make_recombination(int degree);

/// One patch for all sites: the moments of the whole measure, up to the degree that the budget allows (or
/// `degree`, if that is less; for d = 1 up to degree 2N - 1), and nothing local. Else as make_recombination.
std::unique_ptr<Thinning> make_levelwise_recombination(int degree);

/// Bytes that one patch for all sites works with beyond the sites: matrices of 2N points by N moments and of their null
/// space. Nothing for d = 1, whose patches are Gauss quadratures.
double levelwise_bytes(std::size_t dimension, std::size_t nodes);

/// The degree chosen for d >= 2 components that vary: the largest r with at least 2 r patches of q nodes, but
/// at most 5 (d = 2), 3 (d = 3, 4), 2 (d >= 5), beyond which the reduction costs more than further nodes that
/// do as much for the error; 1 or, with a budget below 1 + d, 0 if no r has that many patches.
int recombination_degree(std::size_t dimension, std::size_t budget);

/// (d + r choose r), the number of moments of degree at most r in d variables; at most `cap`.
std::size_t moment_number(std::size_t dimension, int degree, std::size_t cap);

}  // namespace wienertree
