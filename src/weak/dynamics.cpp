#include "wienertree/weak/dynamics.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace wienertree {
namespace {

double rate_at(const Model& model, const std::vector<double>& x) {
  const std::size_t d = model.state_dimension(), p = model.noise_dimension();
  Batch moved(d, 2 * d), drift(d, 2 * d), noise(d * p, 2 * d);
  std::vector<double> h(d);
  for (std::size_t l = 0; l < d; ++l) {
    h[l] = 1e-5 * (1e-3 + std::abs(x[l]));
    for (std::size_t i = 0; i < d; ++i) moved(i, 2 * l) = moved(i, 2 * l + 1) = x[i];
    moved(l, 2 * l) += h[l];
    moved(l, 2 * l + 1) -= h[l];
  }
  model.fields->ito_drift(moved, drift);
  model.fields->diffusion(moved, noise);
  const auto n = static_cast<Eigen::Index>(d);
  Eigen::MatrixXd J(n, n), squares = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::MatrixXd> DV(p, Eigen::MatrixXd(n, n));
  for (std::size_t l = 0; l < d; ++l) {
    for (std::size_t i = 0; i < d; ++i)
      J(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(l)) =
          (drift(i, 2 * l) - drift(i, 2 * l + 1)) / (2 * h[l]);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 0; j < p; ++j)
        DV[j](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(l)) =
            (noise(i * p + j, 2 * l) - noise(i * p + j, 2 * l + 1)) / (2 * h[l]);
  }
  for (const Eigen::MatrixXd& D : DV) squares += D * D;
  const auto radius = [](const Eigen::MatrixXd& A) {
    return A.allFinite() ? Eigen::EigenSolver<Eigen::MatrixXd>(A, false).eigenvalues().cwiseAbs().maxCoeff()
                         : 0;
  };
  return radius(J) + radius(squares);
}

bool inside(const Model& model, const std::vector<double>& x) {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!std::isfinite(x[i]) || !(x[i] > model.bounds[i].lower && x[i] < model.bounds[i].upper)) return false;
  return true;
}

}  // namespace

double fastest_rate(const Model& model, double T) {
  const std::size_t d = model.state_dimension();
  std::vector<double> x = model.initial;
  double rate = rate_at(model, x);
  Batch at(d, 1), drift(d, 1);
  constexpr int steps = 64;
  for (int step = 1; step <= steps; ++step) {
    for (std::size_t i = 0; i < d; ++i) at(i, 0) = x[i];
    model.fields->ito_drift(at, drift);
    for (std::size_t i = 0; i < d; ++i) x[i] += T / steps * drift(i, 0);
    if (!inside(model, x)) break;
    if (step % 16 == 0) rate = std::max(rate, rate_at(model, x));
  }
  return rate;
}

std::vector<BoundTrouble> bound_troubles(const Model& model) {
  std::vector<BoundTrouble> troubles;
  const std::size_t d = model.state_dimension(), p = model.noise_dimension();
  Batch x(d, 1), V0(d, 1), V(d * p, 1);
  std::vector<double> time(1 + p, 0.0);
  time[0] = 1;
  for (std::size_t i = 0; i < d; ++i) {
    const StateBound& bound = model.bounds[i];
    if (bound.boundary == Boundary::error) continue;
    for (const double at : {bound.lower, bound.upper}) {
      if (!std::isfinite(at)) continue;
      for (std::size_t l = 0; l < d; ++l) x(l, 0) = model.initial[l];
      const double scale = std::abs(model.initial[i] - at) + 1e-3;
      const double inwards = at == bound.lower ? 1 : -1;
      // Just inside: on the bound itself an absorbed state has no fields, and a root no derivative.
      x(i, 0) = at + inwards * 1e-9 * scale;
      model.fields->direct(x, time, V0);
      model.fields->diffusion(x, V);
      double noise = 0;
      for (std::size_t j = 0; j < p; ++j) noise = std::max(noise, std::abs(V(i * p + j, 0)));
      // A root at the distance 1e-9 is 3e-5 of what it is at the distance 1.
      Batch start(d, 1), usual(d * p, 1);
      for (std::size_t l = 0; l < d; ++l) start(l, 0) = model.initial[l];
      model.fields->diffusion(start, usual);
      double typical = 0;
      for (std::size_t j = 0; j < p; ++j) typical = std::max(typical, std::abs(usual(i * p + j, 0)));
      if (noise > 1e-2 * typical && typical > 0)
        troubles.push_back(
            {i, inwards < 0, at,
             fmt::format(
                 "noise does not vanish on the bound {} = {:g}, and what reaches it within a step is missed",
                 model.state_names[i], at)});
      else if (V0(i, 0) * inwards < -1e-6 * (std::abs(V0(i, 0)) + typical * typical / scale))
        troubles.push_back(
            {i, inwards < 0, at,
             fmt::format("V_0 = {:.3g} leads out of the bound {} = {:g}, where nodes are held by `boundary`",
                         V0(i, 0), model.state_names[i], at)});
    }
  }
  return troubles;
}

}  // namespace wienertree
