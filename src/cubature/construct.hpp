#pragma once
/// Formulas in closed form, for any number of Brownian motions.
#include "wienertree/cubature/formula.hpp"
#include "wienertree/cubature/gaussian_cubature.hpp"

namespace wienertree {

/// Degree 3, any p: 2p straight paths with increments +-sqrt(p) e_i, dw^0 = 1, weight 1/(2p) (Lyons, Victoir
/// 2004).
/// @throws InputError if p < 1
CubatureFormula construct_degree_3(int p);

/// Degree 5, p = 1: weights 1/6, 2/3, 1/6; the middle path is zero, the outer ones are -+ three segments of
/// length 1/3 with increments a, b, a, where a = (sqrt 3/6)(4 - sqrt 22) and b = (sqrt 3/3)(sqrt 22 - 1)
/// (Lyons, Victoir 2004, section 5).
CubatureFormula construct_lyons_victoir_5_1();

/// Degree 5 from a Gaussian rule of degree 5 (Ninomiya, Victoir 2008, Appl. Math. Finance 15, 107-121): each
/// point z of weight mu gives two paths of weight mu/2: half of time, then z_1 e_1, .., z_p e_p, then half of
/// time; and the same with the e_i in reverse order. Segments of zero increment are left out, and where at
/// most one coordinate of z is not zero the two paths coincide and are one of weight mu.
/// @throws InputError as require_degree_5
CubatureFormula construct_ninomiya_victoir(const GaussianCubature& rule);

/// construct_ninomiya_victoir(gaussian_cubature_5(p)). @throws InputError as gaussian_cubature_5
CubatureFormula construct_ninomiya_victoir(int p);

/// The formula of this degree in closed form, with all its moments verified: degree 3, any p; degree 5, p = 1
/// (Lyons-Victoir) and p = 2..16 (Ninomiya-Victoir).
/// @throws InputError if there is none, or if p is so large that it cannot be verified (GradedWords::limit)
CubatureFormula construct(int degree, int p);

}  // namespace wienertree
