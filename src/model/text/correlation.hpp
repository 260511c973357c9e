#pragma once
/// Correlated Brownian motions as combinations of independent ones.
///
/// Where the columns of the diffusion refer to W with correlation R, W = L B with B independent and L L^T = R:
/// the fields along B are V_k = sum_j V^W_j L_jk. L = M D^{1/2} with M lower triangular with a unit diagonal,
///
///     D_k = R_kk - sum_{m<k} M_km^2 D_m,      M_jk = (R_jk - sum_{m<k} M_jm M_km D_m) / D_k   (j > k),
///
/// in which no root occurs but those of the D_k (Golub, Van Loan 2013, Matrix Computations, section 4.1.2).
/// Where D_k = 0 column k of L is zero: such an R is singular.
#include <Eigen/Core>
#include <vector>

#include "wienertree/model/text/model_source.hpp"

namespace wienertree::text {

struct BrownianCorrelation {
  Eigen::MatrixXd matrix;     ///< R at the parameters' values, p x p; empty where they are independent
  std::vector<bool> present;  ///< whether D_k > 0, p entries
  Eigen::MatrixXd factor;     ///< L at the parameters' values, p x p
};

/// @throws InputError naming the entry of a matrix that is not symmetric, has no unit diagonal, an entry outside
/// [-1, 1] or a negative eigenvalue, with the value
BrownianCorrelation brownian_correlation(const ModelSource& source, const std::vector<double>& parameters);

}  // namespace wienertree::text
