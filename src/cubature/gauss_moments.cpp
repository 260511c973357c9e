#include "wienertree/cubature/gauss_moments.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace wienertree {

namespace {

using Four = GaussRule::Values;
using LongFour = std::array<long double, 4>;

// Of the recurrence  e_{i+1} sqrt(beta_{i+1}) = (z - alpha_i) e_i - sqrt(beta_i) e_{i-1}.
GaussRule rule_of_recurrence(const LongFour& alpha, const LongFour& beta, std::size_t q) {
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;
  const auto size = static_cast<Eigen::Index>(q);
  Vector diagonal(size), beside(size - 1);
  Four a{}, b{};
  for (std::size_t k = 0; k < q; ++k) {
    diagonal(static_cast<Eigen::Index>(k)) = a[k] = static_cast<double>(alpha[k]);
    b[k] = std::sqrt(static_cast<double>(beta[k]));
    if (k > 0) beside(static_cast<Eigen::Index>(k) - 1) = b[k];
  }
  Eigen::SelfAdjointEigenSolver<Matrix> solver(size);
  solver.computeFromTridiagonal(diagonal, beside, Eigen::EigenvaluesOnly);
  GaussRule rule;
  rule.size = q;
  // e_{i+1} = ((z - a_i) e_i - b_i e_{i-1}) / b_{i+1}
  rule.coefficient[0][0] = 1;
  for (std::size_t i = 0; i + 1 < q; ++i)
    for (std::size_t r = 0; r <= i + 1; ++r)
      rule.coefficient[i + 1][r] = ((r > 0 ? rule.coefficient[i][r - 1] : 0) - a[i] * rule.coefficient[i][r] -
                                    (i > 0 ? b[i] * rule.coefficient[i - 1][r] : 0)) /
                                   b[i + 1];
  double total = 0;
  for (std::size_t m = 0; m < q; ++m) {
    const double z = rule.node[m] = solver.eigenvalues()(static_cast<Eigen::Index>(m));
    double squares = rule.value[0][m] = 1;
    for (std::size_t i = 0; i + 1 < q; ++i) {
      const double e = ((z - a[i]) * rule.value[i][m] - (i > 0 ? b[i] * rule.value[i - 1][m] : 0)) / b[i + 1];
      rule.value[i + 1][m] = e;
      squares += e * e;
    }
    rule.weight[m] = 1 / squares;
    total += rule.weight[m];
  }
  for (std::size_t m = 0; m < q; ++m) rule.weight[m] /= total;
  return rule;
}

}  // namespace

GaussRule gauss_rule(const std::array<long double, 9>& moment, std::size_t q) {
  LongFour alpha{}, beta{};
  std::array<long double, 9> current = moment, previous{};
  beta[0] = 1;
  for (std::size_t k = 1; k < q; ++k) {
    std::array<long double, 9> next{};
    for (std::size_t j = k; j < 2 * q - k; ++j)
      next[j] = current[j + 1] - alpha[k - 1] * current[j] - (k > 1 ? beta[k - 1] * previous[j] : 0);
    beta[k] = next[k] / current[k - 1];
    // A law of k points.
    if (!(beta[k] > 1e-12L)) return rule_of_recurrence(alpha, beta, k);
    alpha[k] = next[k + 1] / next[k] - current[k] / current[k - 1];
    previous = current;
    current = next;
  }
  return rule_of_recurrence(alpha, beta, q);
}

}  // namespace wienertree
