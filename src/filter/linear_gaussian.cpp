#include "wienertree/filter/linear_gaussian.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace wienertree {
namespace {

[[noreturn]] void refuse(const Model& model, const std::string& why) {
  throw InputError("the exact filter of a linear model does not apply: " + why, "model " + model.name);
}

void copy_sensor(const Model& model, LinearGaussianModel& l) {
  l.H.resize(0, l.A.rows());
  l.c.resize(0);
  if (model.observation == ObservationKind::none) return;
  const AffineSensor* sensor = model.fields->affine_sensor();
  if (!sensor) refuse(model, "the sensor h is not affine");
  l.H = sensor->linear;
  l.c = sensor->constant;
}

void copy_start(const Model& model, LinearGaussianModel& l) {
  const Eigen::Index d = l.A.rows();
  if (model.initial_law) {
    l.mean = model.initial_law->mean;
    l.covariance = model.initial_law->covariance;
  } else {
    l.mean = Eigen::Map<const Eigen::VectorXd>(model.initial.data(), d);
    l.covariance = Eigen::MatrixXd::Zero(d, d);
  }
}

}  // namespace

LinearGaussianModel linear_gaussian_model(const Model& model) {
  const AffineFields* fields = model.fields->affine_fields();
  if (!fields) refuse(model, "the drift or the diffusion is not affine");
  for (std::size_t i = 0; i < model.bounds.size(); ++i)
    if (model.bounds[i].bounded()) refuse(model, fmt::format("state {} is bounded", model.state_names[i]));
  const auto d = static_cast<Eigen::Index>(model.state_dimension());
  LinearGaussianModel l;
  l.A = fields->linear[0];
  l.a = fields->constant[0];
  l.Q = Eigen::MatrixXd::Zero(d, d);
  for (std::size_t j = 1; j < fields->linear.size(); ++j) {
    if (!fields->linear[j].isZero(0))
      refuse(model, fmt::format("the diffusion of Brownian motion {} depends on the state", j));
    l.Q += fields->constant[j] * fields->constant[j].transpose();
  }
  copy_sensor(model, l);
  copy_start(model, l);
  return l;
}

void SingleGaussian::assign(const Eigen::VectorXd& m, const Eigen::MatrixXd& P, Posterior& posterior) {
  const auto d = static_cast<std::size_t>(m.size());
  point_.reshape(d, 1);
  std::copy(m.data(), m.data() + m.size(), point_.view().data());
  covariance_.reshape(P.isZero(0) ? 0 : d * d, 1);
  if (covariance_.components() > 0) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(P);
    Eigen::Map<Eigen::MatrixXd> out(covariance_.view().data(), m.size(), m.size());
    out = P;
    for (Eigen::Index i = 0; i < m.size() && axes.eigenvalues()(i) < 0; ++i)
      out -= axes.eigenvalues()(i) * axes.eigenvectors().col(i) * axes.eigenvectors().col(i).transpose();
  }
  posterior.points = point_;
  posterior.covariance = covariance_;
  posterior.weight = weight_;
  posterior.kept = 1;
}

}  // namespace wienertree
