#pragma once
/// Cubature formulas on Wiener space.
///
/// A formula of degree m in dimension p: piecewise linear paths w_1..w_c : [0,1] -> R^{1+p} and weights
/// lambda_j > 0 such that for every word alpha in {0..p}^k of degree ||alpha|| = k + #{a_i = 0} <= m the
/// lambda-average of the iterated integrals of w_j over alpha equals the expected Stratonovich iterated
/// integral of (t, B) on [0,1] (Lyons, Victoir 2004, Proc. R. Soc. Lond. A 460, 169-198).
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace wienertree {

/// Piecewise linear path: column s is segment s, (dw^0, dw^1, .., dw^p). dw^0 is time-like and may be 0.
struct CubaturePath {
  double weight = 0;           ///< lambda > 0
  Eigen::MatrixXd increments;  ///< (1+p) x segments
  /// Row k scales as s^{degree[k]/2} with the length s of a step. Empty: 2 for row 0, 1 for the others, as
  /// Brownian motion does. Lie brackets that drive a path have degrees of their own.
  std::vector<int> degree = {};
};

struct CubatureFormula {
  std::string name;
  int degree = 0;     ///< m
  int dimension = 0;  ///< p
  std::string source;
  std::vector<CubaturePath> paths;
};

/// Increments of segment `segment` for a step of length s: dw^0 -> s dw^0, dw^i -> sqrt(s) dw^i, or as the
/// path's `degree` says.   out: 1+p values.
void scaled_increments(const CubaturePath& path, std::size_t segment, double s, std::span<double> out);

}  // namespace wienertree
