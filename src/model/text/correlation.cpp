#include "wienertree/model/text/correlation.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "wienertree/model/text/field_expressions.hpp"

namespace wienertree::text {
namespace {

using Eigen::Index;

// A sum of p products of numbers up to 1 is rounded by p units in the last place: 100 of these are no rounding.
double rounding(std::size_t p) { return 2e-14 * static_cast<double>(p); }

Eigen::MatrixXd checked_matrix(const ModelSource& source, const std::vector<double>& parameters) {
  const std::size_t p = source.correlation.size();
  Eigen::MatrixXd R(static_cast<Index>(p), static_cast<Index>(p));
  for (std::size_t j = 0; j < p; ++j)
    for (std::size_t k = 0; k < p; ++k) {
      const SourceExpression& entry = source.correlation[j][k];
      const double value = constant_value(entry, source, parameters);
      const auto fail = [&](const char* message, const std::string& shown) {
        throw InputError(message, entry.location.text(), shown);
      };
      if (j == k && !(std::abs(value - 1) <= rounding(p)))
        fail("the correlation of a Brownian motion with itself is 1", fmt::format("{}", value));
      if (!(std::abs(value) <= 1 + rounding(p)))
        fail("a correlation lies between -1 and 1", fmt::format("{}", value));
      R(static_cast<Index>(j), static_cast<Index>(k)) = value;
      const double other = k < j ? R(static_cast<Index>(k), static_cast<Index>(j)) : value;
      if (!(std::abs(value - other) <= rounding(p)))
        fail("the correlation is not symmetric", fmt::format("{} and {}", value, other));
    }
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(R, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  // Eigenvalues of a correlation matrix add up to p.
  if (least < -rounding(p) * static_cast<double>(p))
    throw InputError("the correlation has a negative eigenvalue: no Brownian motions are correlated so",
                     source.correlation[0][0].location.text(), fmt::format("{}", least));
  return R;
}

}  // namespace

BrownianCorrelation brownian_correlation(const ModelSource& source, const std::vector<double>& parameters) {
  BrownianCorrelation result;
  if (source.correlation.empty()) return result;
  result.matrix = checked_matrix(source, parameters);
  const Index p = result.matrix.rows();
  const double least = rounding(static_cast<std::size_t>(p)) * static_cast<double>(p);
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(p, p);
  Eigen::VectorXd D = Eigen::VectorXd::Zero(p);
  for (Index k = 0; k < p; ++k) {
    D(k) = result.matrix(k, k);
    for (Index m = 0; m < k; ++m) D(k) -= M(k, m) * M(k, m) * D(m);
    if (D(k) <= least) D(k) = 0;
    for (Index j = k + 1; j < p; ++j) {
      double rest = result.matrix(j, k);
      for (Index m = 0; m < k; ++m) rest -= M(j, m) * M(k, m) * D(m);
      M(j, k) = D(k) > 0 ? rest / D(k) : 0;
    }
    result.present.push_back(D(k) > 0);
  }
  result.factor = M * D.cwiseSqrt().asDiagonal();
  return result;
}

}  // namespace wienertree::text
