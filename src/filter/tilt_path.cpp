#include "wienertree/filter/tilt_path.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "wienertree/filter/small_matrix.hpp"

namespace wienertree {
namespace {

constexpr int iterations = 3;

Eigen::MatrixXd symmetric(const Eigen::MatrixXd& M) { return 0.5 * (M + M.transpose()); }

}  // namespace

void TiltPath::flow(Batch& x, double clock, double length, unsigned steps) {
  const std::size_t d = equations_.states(), D = model_.state_dimension(), N = x.nodes();
  const double h = length / steps;
  for (Batch& k : k_) k.reshape(D, N);
  stage_.reshape(D, N);
  for (unsigned step = 0; step < steps; ++step) {
    const double t = clock + step * h;
    for (std::size_t s = 0; s < 4; ++s) {
      const double part = s == 0 ? 0 : s == 3 ? h : h / 2;
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t n = 0; n < N; ++n) stage_(i, n) = x(i, n) + (s == 0 ? 0.0 : part * k_[s - 1](i, n));
      equations_.complete(stage_, t + part);
      model_.fields->ito_drift(stage_, k_[s]);
    }
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t n = 0; n < N; ++n)
        x(i, n) += h / 6 * (k_[0](i, n) + 2 * k_[1](i, n) + 2 * k_[2](i, n) + k_[3](i, n));
  }
}

TiltPath::Transition TiltPath::linearise(const LawMoments& law, double clock, double length, unsigned steps) {
  const std::size_t d = equations_.states(), D = model_.state_dimension();
  const auto rows = static_cast<Eigen::Index>(d);
  const GaussianCubature& rule = equations_.rule();
  const Eigen::Index points = rule.weights.size();
  const Eigen::MatrixXd a = equations_.mean_diffusion(law.mean, law.covariance, clock, scratch_);
  // A law without width is given some, so that there is a slope: 1e-4 standard deviations of a substep's noise.
  Eigen::MatrixXd P = law.covariance;
  for (Eigen::Index i = 0; i < rows; ++i)
    P(i, i) += 1e-8 * (P(i, i) + a(i, i) * length) + 1e-14 * (1e-6 + law.mean(i) * law.mean(i));
  const Eigen::MatrixXd L = semidefinite_root(P);
  const Eigen::MatrixXd z = rule.points;
  const Eigen::MatrixXd start = (L * z).colwise() + law.mean;

  // After the points come, for each column of sigma, two more for second derivatives of the drift.
  const Eigen::MatrixXd noise = semidefinite_root(a);
  constexpr double e = 1e-2;
  x_.reshape(D, static_cast<std::size_t>(points));
  for (std::size_t i = 0; i < d; ++i)
    for (Eigen::Index q = 0; q < points; ++q)
      x_(i, static_cast<std::size_t>(q)) = start(static_cast<Eigen::Index>(i), q);
  flow(x_, clock, length, steps);
  Eigen::MatrixXd end(rows, points);
  for (std::size_t i = 0; i < d; ++i)
    for (Eigen::Index q = 0; q < points; ++q)
      end(static_cast<Eigen::Index>(i), q) = x_(i, static_cast<std::size_t>(q));

  Transition t;
  const Eigen::VectorXd mean = end * rule.weights;
  const Eigen::MatrixXd deviation = end.colwise() - mean;
  const Eigen::MatrixXd weighted = deviation * rule.weights.asDiagonal();
  const Eigen::MatrixXd slope = weighted * z.transpose();  // F L
  t.F = L.triangularView<Eigen::Lower>().solve<Eigen::OnTheRight>(slope);
  const Eigen::MatrixXd residual = symmetric(weighted * deviation.transpose() - slope * slope.transpose());

  Batch probe(D, 1 + 2 * d), drift(D, 1 + 2 * d);
  const double scale = e * std::sqrt(length);
  for (std::size_t i = 0; i < d; ++i) {
    const auto I = static_cast<Eigen::Index>(i);
    probe(i, 0) = law.mean(I);
    for (std::size_t k = 0; k < d; ++k) {
      probe(i, 1 + 2 * k) = law.mean(I) + scale * noise(I, static_cast<Eigen::Index>(k));
      probe(i, 2 + 2 * k) = law.mean(I) - scale * noise(I, static_cast<Eigen::Index>(k));
    }
  }
  equations_.complete(probe, clock);
  model_.fields->ito_drift(probe, drift);
  t.g = mean;
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t k = 0; k < d; ++k)
      t.g(static_cast<Eigen::Index>(i)) += 0.25 * length * length *
                                           (drift(i, 1 + 2 * k) + drift(i, 2 + 2 * k) - 2 * drift(i, 0)) /
                                           (scale * scale);
  const Eigen::MatrixXd half = 0.5 * (Eigen::MatrixXd::Identity(rows, rows) + t.F);
  t.Q = length / 6 * (t.F * a * t.F.transpose() + 4 * half * a * half.transpose() + a) + residual;
  t.Q = symmetric(t.Q);
  return t;
}

std::vector<Tilt> TiltPath::plan(const LawMoments& start, double clock, double length, std::size_t substeps,
                                 unsigned steps, const Final& final_tilt) {
  const std::size_t d = equations_.states();
  const auto rows = static_cast<Eigen::Index>(d);
  const double s = length / static_cast<double>(substeps);
  const auto time = [&](std::size_t j) { return clock + s * static_cast<double>(j); };
  reference_.assign(1, start);
  Batch m(d, 1), P(d * d, 1);
  put_vector(start.mean, m, 0);
  put_square(start.covariance, P, 0);
  for (std::size_t j = 0; j < substeps; ++j) {
    equations_.move(m, P, time(j), s, steps, scratch_);
    reference_.push_back({vector_of<Eigen::Dynamic>(m, d, 0), square_of<Eigen::Dynamic>(P, d, 0)});
  }
  std::vector<Tilt> tilts(substeps + 1);
  std::vector<Transition> transitions(substeps);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t j = 0; j < substeps; ++j) transitions[j] = linearise(reference_[j], time(j), s, steps);
    tilts[substeps] = final_tilt(reference_[substeps]);
    for (std::size_t j = substeps; j-- > 0;) {
      const Transition& t = transitions[j];
      const Tilt& next = tilts[j + 1];
      const Eigen::MatrixXd B = Eigen::MatrixXd::Identity(rows, rows) + next.H * t.Q;
      const Eigen::PartialPivLU<Eigen::MatrixXd> solver(B);
      tilts[j].centre = reference_[j].mean;
      tilts[j].H = symmetric(t.F.transpose() * solver.solve(next.H * t.F));
      tilts[j].f = t.F.transpose() * solver.solve(next.f - next.H * (t.g - next.centre));
    }
    LawMoments forward = start;
    for (std::size_t j = 0; j <= substeps; ++j) {
      LawMoments tilted = forward;
      multiply(tilted.mean, tilted.covariance, tilts[j]);
      if (j < substeps) {
        const Transition& t = transitions[j];
        forward.mean = t.g + t.F * (forward.mean - reference_[j].mean);
        forward.covariance = symmetric(t.F * forward.covariance * t.F.transpose() + t.Q);
      }
      reference_[j] = std::move(tilted);
    }
  }
  return tilts;
}

Tilt tilt_between(const LawMoments& from, const LawMoments& to) {
  using Square = SmallSquare<Eigen::Dynamic>;
  const Whitening<Eigen::Dynamic> white{Square(from.covariance)};
  const Square C = white.whitening * to.covariance * white.whitening.transpose();
  const SymmetricEigen<Eigen::Dynamic> eigen(C);
  const SmallVector<Eigen::Dynamic> u = eigen.vectors.transpose() * (white.whitening * (to.mean - from.mean));
  SmallVector<Eigen::Dynamic> h(u.size()), f(u.size());
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    h(i) = std::max(0.0, 1 / std::max(eigen.values(i), 1e-12) - 1);
    f(i) = (1 + h(i)) * u(i);
  }
  const Square back = white.whitening.transpose() * eigen.vectors;
  return {from.mean, back * h.asDiagonal() * back.transpose(), back * f};
}

}  // namespace wienertree
