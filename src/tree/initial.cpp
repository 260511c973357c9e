#include "wienertree/tree/initial.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "wienertree/cubature/construct.hpp"

namespace wienertree {
namespace {

constexpr std::size_t fewest_points =
    1000;  // of a grid: the first observation may be much sharper than the start
// The trapezoidal rule of spacing h errs by about 2 exp(-2 pi^2/h^2) in a Gaussian's moments: 3e-5 for 10 points.
constexpr Eigen::Index fewest_per_axis = 10;
constexpr double reach = 6.0;  // mass beyond 6 standard deviations: 2e-9

// Columns are standard normal points in R^r with log-weights, normalised to mass one.
struct StandardLaw {
  Eigen::MatrixXd points;
  Eigen::VectorXd log_weight;
};

StandardLaw tensor_grid(Eigen::Index r, Eigen::Index per_axis) {
  Eigen::Index total = 1;
  for (Eigen::Index i = 0; i < r; ++i) total *= per_axis;
  StandardLaw law{Eigen::MatrixXd(r, total), Eigen::VectorXd(total)};
  const double spacing = 2 * reach / static_cast<double>(per_axis - 1);
  for (Eigen::Index n = 0; n < total; ++n) {
    Eigen::Index rest = n;
    for (Eigen::Index i = 0; i < r; ++i, rest /= per_axis)
      law.points(i, n) = -reach + spacing * static_cast<double>(rest % per_axis);
    law.log_weight(n) = -law.points.col(n).squaredNorm() / 2;
  }
  law.log_weight.array() -= std::log(law.log_weight.array().exp().sum());
  return law;
}

StandardLaw cubature_points(Eigen::Index r) {
  const GaussianCubature rule = gaussian_cubature_5(static_cast<int>(r));
  return {rule.points, rule.weights.array().log().matrix()};
}

// Columns L with L L^T = covariance, as many as its rank.
Eigen::MatrixXd covariance_root(const Model& model) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(model.initial_law->covariance);
  const Eigen::VectorXd& variance = axes.eigenvalues();
  // An eigenvalue of a symmetric matrix is computed to about d eps times the largest one.
  const double negligible = 1e-14 * static_cast<double>(variance.size()) * std::max(0.0, variance.maxCoeff());
  if (variance.minCoeff() < -negligible)
    throw InputError("the covariance of the initial law is not positive semidefinite", "model " + model.name,
                     fmt::format("eigenvalue {}", variance.minCoeff()));
  const Eigen::Index r =
      (variance.array() > negligible).count();  // eigenvalues ascend: the last r span the law
  return axes.eigenvectors().rightCols(r) * variance.tail(r).cwiseSqrt().asDiagonal();
}

}  // namespace

Generation first_generation(const Model& model, std::size_t nodes) {
  const std::size_t d = model.state_dimension();
  Generation g;
  if (!model.initial_law) {
    g.states.reshape(d, 1);
    std::copy(model.initial.begin(), model.initial.end(), g.states.view().data());
    g.log_weight = {0.0};
    return g;
  }
  const InitialLaw& law = *model.initial_law;
  const Eigen::MatrixXd root = covariance_root(model);
  const Eigen::Index r = root.cols();
  StandardLaw standard;
  if (r == 0) {
    standard = {Eigen::MatrixXd(0, 1), Eigen::VectorXd::Zero(1)};
  } else {
    const auto per_axis = static_cast<Eigen::Index>(std::floor(
        std::pow(static_cast<double>(std::max(nodes, fewest_points)), 1.0 / static_cast<double>(r)) + 1e-9));
    standard = per_axis >= fewest_per_axis ? tensor_grid(r, per_axis) : cubature_points(r);
  }
  const Eigen::MatrixXd points = (root * standard.points).colwise() + law.mean;
  g.states.reshape(d, static_cast<std::size_t>(points.cols()));
  for (std::size_t n = 0; n < g.size(); ++n)
    for (std::size_t i = 0; i < d; ++i)
      g.states(i, n) = points(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(n));
  g.log_weight.assign(standard.log_weight.data(), standard.log_weight.data() + standard.log_weight.size());
  return g;
}

void draw_initial(const Model& model, const RandomStream& random, std::size_t nodes, Batch& x) {
  const std::size_t d = model.state_dimension();
  x.reshape(d, nodes);
  if (!model.initial_law) {
    for (std::size_t i = 0; i < d; ++i) std::fill_n(x.component(i).begin(), nodes, model.initial[i]);
    return;
  }
  const Eigen::MatrixXd root = covariance_root(model);
  Eigen::VectorXd z(root.cols());
  for (std::size_t n = 0; n < nodes; ++n) {
    random.normals(n * static_cast<std::size_t>(z.size()), {z.data(), static_cast<std::size_t>(z.size())});
    const Eigen::VectorXd start = model.initial_law->mean + root * z;
    for (std::size_t i = 0; i < d; ++i) x(i, n) = start(static_cast<Eigen::Index>(i));
  }
}

}  // namespace wienertree
