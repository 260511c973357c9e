#pragma once
/// Cubature for the standard Gaussian measure on R^p, the finite-dimensional ancestor of cubature on Wiener
/// space.
#include <Eigen/Core>
#include <string>

namespace wienertree {

/// sum_k weights[k] f(points.col(k)) ~ E f(Z), Z ~ N(0, I_p).
struct GaussianCubature {
  Eigen::MatrixXd points;   ///< p x n
  Eigen::VectorXd weights;  ///< n, positive, sum 1
  std::string source;
};

/// Largest p for which gaussian_cubature_5 has a rule.
inline constexpr int gaussian_cubature_5_max_dimension = 16;

/// A rule exact for all polynomials of degree <= 5, with positive weights for every p:
///
/// - p = 1: Gauss-Hermite, 3 points: 0 (2/3), +-sqrt 3 (1/6).
/// - p = 2: Radon's 7 points: 0 (1/2), a regular hexagon of radius 2 (1/12 each).
/// - p = 3: 13 points: 0 (2/5), the vertices of an icosahedron of radius sqrt 5 (1/20 each).
/// - p = 4: 25 points: 0 (1/3), all permutations of (+-s, +-s, 0, 0), s^2 = 3 (1/36 each): Stroud and
///   Secrest's rule with 2p^2+1 points, whose points on the axes have weight (4-p)/(2(p+2)^2), zero here and
///   negative for p > 4.
/// - p = 5..16: +-r e_i, r^2 = (p+2)/2, weight 1/r^4 = 4/(p+2)^2 each, and s v for the rows v of a two-level
///   orthogonal array of strength 5, s^2 = (p+2)/(p-2), total weight 1/s^4. With all 2^p rows it is Stroud's
///   rule E_n^{r^2} 5-3; an orthogonal array has the same moments up to degree 5 (Victoir 2004). The arrays:
///   all of {+-1}^p for p = 5, the rows of even weight for p = 6, 7, 8, the Nordstrom-Robinson code (256 rows
///   of length 16) for p = 9..16. Points: 42, 44, 78, 144, then 2p + 256.
///
/// Stroud (1971), Approximate Calculation of Multiple Integrals, Prentice Hall; Stroud, Secrest (1963),
/// Math. Comp. 17, 105-135; Victoir (2004), SIAM J. Numer. Anal. 42, 209-227.
///
/// @throws InputError if p < 1 or p > gaussian_cubature_5_max_dimension
GaussianCubature gaussian_cubature_5(int p);

/// Largest error over all monomials of degree <= `degree`: |sum_k w_k z_k^alpha - E Z^alpha|, where E Z^alpha
/// is the product of the (alpha_i - 1)!! if all alpha_i are even, and 0 otherwise.
double max_monomial_error(const GaussianCubature& rule, int degree);

/// @throws InputError if a weight is not positive, or a monomial of degree <= 5 is off by more than 1e-12
void require_degree_5(const GaussianCubature& rule);

}  // namespace wienertree
