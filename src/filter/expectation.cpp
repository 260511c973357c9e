#include "wienertree/filter/expectation.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <vector>

namespace wienertree {

GaussianCubature gauss_hermite(int dimension, int points) {
  // x He_k = He_{k+1} + k He_{k-1}: the Jacobi matrix of the orthonormal polynomials has sqrt(k) beside its
  // zero diagonal.
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(points, points);
  for (int k = 1; k < points; ++k) jacobi(k, k - 1) = jacobi(k - 1, k) = std::sqrt(k);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axis(jacobi);
  Eigen::Index total = 1;
  for (int i = 0; i < dimension; ++i) total *= points;
  GaussianCubature rule{Eigen::MatrixXd(dimension, total), Eigen::VectorXd::Ones(total), "Gauss-Hermite"};
  for (Eigen::Index n = 0; n < total; ++n) {
    Eigen::Index rest = n;
    for (int i = 0; i < dimension; ++i, rest /= points) {
      const Eigen::Index k = rest % points;
      rule.points(i, n) = axis.eigenvalues()(k);
      rule.weights(n) *= axis.eigenvectors()(0, k) * axis.eigenvectors()(0, k);
    }
  }
  return rule;
}

GaussianCubature rule_of_one_gaussian(int dimension) {
  if (dimension <= 3) {
    constexpr std::array points = {11, 7, 5};
    return gauss_hermite(dimension, points[static_cast<std::size_t>(dimension - 1)]);
  }
  if (dimension <= gaussian_cubature_5_max_dimension) return gaussian_cubature_5(dimension);
  GaussianCubature rule{Eigen::MatrixXd::Zero(dimension, 2 * dimension),
                        Eigen::VectorXd::Constant(2 * dimension, 0.5 / dimension), "degree 3"};
  for (int i = 0; i < dimension; ++i) {
    rule.points(i, 2 * i) = std::sqrt(dimension);
    rule.points(i, 2 * i + 1) = -std::sqrt(dimension);
  }
  return rule;
}

double expectation(const Posterior& posterior, const BatchFunction& phi) {
  const std::size_t N = posterior.size(), d = posterior.points.components();
  std::vector<double> value(N);
  double sum = 0;
  const auto add = [&](ConstBatchView x, double part) {
    phi(x, value);
    for (std::size_t n = 0; n < N; ++n) sum += part * posterior.weight[n] * value[n];
  };
  if (posterior.dirac()) {
    add(posterior.points, 1);
    return sum;
  }
  Batch L(d * d, posterior.covariance.nodes()), x(d, N);
  cholesky(posterior.covariance, d, L);
  const GaussianCubature rule = rule_of_one_gaussian(static_cast<int>(d));
  for (Eigen::Index q = 0; q < rule.weights.size(); ++q) {
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < N; ++n) {
        double at = posterior.points(i, n);
        for (std::size_t k = 0; k <= i; ++k)
          at += L(i * d + k, L.nodes() == 1 ? 0 : n) * rule.points(static_cast<Eigen::Index>(k), q);
        x(i, n) = at;
      }
    add(x, rule.weights(q));
  }
  return sum;
}

void cholesky(ConstBatchView covariance, std::size_t d, BatchView L) {
  constexpr double rounding = 1e-13;
  const std::size_t N = covariance.nodes();
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double* out = L.component(i * d + j).data();
      const double* c = covariance.component(i * d + j).data();
      for (std::size_t n = 0; n < N; ++n) out[n] = c[n];
      for (std::size_t k = 0; k < j; ++k) {
        const double* a = L.component(i * d + k).data();
        const double* b = L.component(j * d + k).data();
        for (std::size_t n = 0; n < N; ++n) out[n] -= a[n] * b[n];
      }
      if (i == j) {
        for (std::size_t n = 0; n < N; ++n) out[n] = out[n] > rounding * c[n] ? std::sqrt(out[n]) : 0.0;
      } else {
        const double* pivot = L.component(j * d + j).data();
        for (std::size_t n = 0; n < N; ++n) out[n] = pivot[n] > 0 ? out[n] / pivot[n] : 0.0;
      }
    }
    for (std::size_t j = i + 1; j < d; ++j)
      for (double& v : L.component(i * d + j)) v = 0;
  }
}

}  // namespace wienertree
