#pragma once
/// Expectations of any function under a posterior.
#include "wienertree/cubature/gaussian_cubature.hpp"
#include "wienertree/filter/posterior.hpp"
#include "wienertree/model/batch_function.hpp"

namespace wienertree {

/// The tensor product of Gauss-Hermite rules of `points` an axis, exact for polynomials of degree
/// 2 points - 1 in each variable: nodes and weights from the Jacobi matrix of the Hermite polynomials
/// (Golub, Welsch 1969, Math. Comp. 23, 221-230). @pre dimension >= 1, points >= 1
GaussianCubature gauss_hermite(int dimension, int points);

/// The rule that integrates one Gaussian of a sum: 11, 7^2, 5^3 points of Gauss-Hermite for d = 1, 2, 3, the
/// cubature of degree 5 for d = 4 .. 16, and 2d points +-sqrt(d) e_i of degree 3 beyond.
GaussianCubature rule_of_one_gaussian(int dimension);

/// E[phi(X)]: over the nodes, or with `rule_of_one_gaussian` for each Gaussian of the sum.
double expectation(const Posterior& posterior, const BatchFunction& phi);

/// L with L L^T = covariance, lower triangular, for a batch of positive semidefinite matrices: a pivot below
/// 1e-13 of its diagonal element is rounding, and its column is zero. covariance, L: d*d x N
/// (component i*d + j).
void cholesky(ConstBatchView covariance, std::size_t d, BatchView L);

}  // namespace wienertree
