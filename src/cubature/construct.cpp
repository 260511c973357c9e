#include "wienertree/cubature/construct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "wienertree/cubature/verification.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

Eigen::VectorXd along(Eigen::Index p, Eigen::Index letter, double increment) {
  Eigen::VectorXd segment = Eigen::VectorXd::Zero(p + 1);
  segment[letter] = increment;
  return segment;
}

CubaturePath path_of(double weight, const std::vector<Eigen::VectorXd>& segments) {
  CubaturePath path;
  path.weight = weight;
  path.increments.resize(segments.front().size(), static_cast<Eigen::Index>(segments.size()));
  for (std::size_t s = 0; s < segments.size(); ++s)
    path.increments.col(static_cast<Eigen::Index>(s)) = segments[s];
  return path;
}

CubaturePath splitting_path(double weight, const Eigen::VectorXd& z, const std::vector<Eigen::Index>& order) {
  const Eigen::Index p = z.size();
  if (order.empty()) return path_of(weight, {along(p, 0, 1)});
  std::vector<Eigen::VectorXd> segments{along(p, 0, 0.5)};
  for (const Eigen::Index i : order) segments.push_back(along(p, i + 1, z[i]));
  segments.push_back(along(p, 0, 0.5));
  return path_of(weight, segments);
}

}  // namespace

CubatureFormula construct_degree_3(int p) {
  if (p < 1) throw InputError("the dimension must be at least 1", "construct_degree_3", fmt::format("{}", p));
  CubatureFormula formula{fmt::format("lyons-victoir-3-{}", p),
                          3,
                          p,
                          "Lyons, Victoir (2004), Cubature on Wiener space, Proc. R. Soc. Lond. A 460",
                          {}};
  for (int i = 1; i <= p; ++i) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::VectorXd segment = along(p, i, sign * std::sqrt(p));
      segment[0] = 1;
      formula.paths.push_back(path_of(1.0 / (2.0 * p), {segment}));
    }
  }
  return formula;
}

CubatureFormula construct_lyons_victoir_5_1() {
  const double third = 1.0 / 3.0;
  const double a = std::sqrt(3.0) / 6 * (4 - std::sqrt(22.0)), b = std::sqrt(3.0) / 3 * (std::sqrt(22.0) - 1);
  CubatureFormula formula{
      "lyons-victoir-5-1",
      5,
      1,
      "Lyons, Victoir (2004), Cubature on Wiener space, Proc. R. Soc. Lond. A 460, section 5",
      {}};
  const auto outer = [&](double sign) {
    return path_of(1.0 / 6.0, {Eigen::Vector2d(third, sign * a), Eigen::Vector2d(third, sign * b),
                               Eigen::Vector2d(third, sign * a)});
  };
  formula.paths = {outer(1), path_of(2.0 / 3.0, {Eigen::Vector2d(1, 0)}), outer(-1)};
  return formula;
}

CubatureFormula construct_ninomiya_victoir(const GaussianCubature& rule) {
  require_degree_5(rule);
  const Eigen::Index p = rule.points.rows();
  CubatureFormula formula{
      fmt::format("ninomiya-victoir-5-{}", p),
      5,
      static_cast<int>(p),
      fmt::format("Ninomiya, Victoir (2008), Appl. Math. Finance 15, over a Gaussian rule of degree 5: {}",
                  rule.source),
      {}};
  for (Eigen::Index k = 0; k < rule.points.cols(); ++k) {
    const Eigen::VectorXd z = rule.points.col(k);
    std::vector<Eigen::Index> order;
    for (Eigen::Index i = 0; i < p; ++i) {
      if (z[i] != 0) order.push_back(i);
    }
    const bool coincide = order.size() <= 1;
    formula.paths.push_back(splitting_path(coincide ? rule.weights[k] : rule.weights[k] / 2, z, order));
    std::reverse(order.begin(), order.end());
    if (!coincide) formula.paths.push_back(splitting_path(rule.weights[k] / 2, z, order));
  }
  return formula;
}

CubatureFormula construct_ninomiya_victoir(int p) {
  return construct_ninomiya_victoir(gaussian_cubature_5(p));
}

CubatureFormula construct(int degree, int p) {
  if (degree != 3 && degree != 5)
    throw InputError("formulas can be constructed for degrees 3 and 5", "construct",
                     fmt::format("degree {}", degree));
  CubatureFormula formula = degree == 3 ? construct_degree_3(p)
                            : p == 1    ? construct_lyons_victoir_5_1()
                                        : construct_ninomiya_victoir(p);
  require_holds(verify(formula, moment_tolerance, false), formula.name);
  return formula;
}

}  // namespace wienertree
