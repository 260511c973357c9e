#pragma once
/// The evidence of a one-dimensional Euler chain by quadrature: what an unbiased particle filter estimates.
///
///     x_{j+1} ~ N(x_j + b(x_j) s, sigma(x_j)^2 s),      evidence = E[prod_j w(x_j, x_{j+1})]
///
/// on a grid of spacing at most 0.7 of the shortest step's standard deviation. The trapezoidal rule for a
/// density that is at least so smooth errs by 2 exp(-2 pi^2 (sd/spacing)^2) < 1e-17 a step; mass beyond the
/// ends is the caller's to avoid.
#include <cmath>
#include <numbers>
#include <vector>

#include "wienertree/filter/filter.hpp"

namespace wienertree::papers {

class ChainEvidence {
 public:
  ChainEvidence(const Model& model, FunctionalMethod functional, double low, double high)
      : model_(model), functional_(functional), low_(low), high_(high) {}

  double log_evidence(const ObservationWindows& windows) {
    double shortest = INFINITY;
    std::vector<ObservationWindow> all(windows.size());
    for (std::size_t j = 0; j < windows.size(); ++j) {
      windows.get(j, all[j]);
      if (all[j].length() > 0) shortest = std::min(shortest, all[j].length());
    }
    lay(shortest);
    double log_mass = 0;
    for (const ObservationWindow& w : all) {
      if (w.at_start || w.length() == 0) weigh(w.observation);
      if (w.length() > 0) move(w);
      if (!w.at_start && w.length() > 0) weigh(w.observation);
      double mass = 0;
      for (const double v : mass_) mass += v;
      for (double& v : mass_) v /= mass;
      log_mass += std::log(mass);
    }
    return log_mass;
  }

 private:
  // The start is the last node of the grid when it is a point: nothing moves back to it.
  void lay(double shortest) {
    Batch one(1, 1), at(1, 1);
    one(0, 0) = (low_ + high_) / 2;
    model_.fields->diffusion(one, at);
    const double spacing = 0.7 * std::abs(at(0, 0)) * std::sqrt(shortest);
    grid_ = static_cast<std::size_t>((high_ - low_) / spacing) + 2;
    width_ = (high_ - low_) / static_cast<double>(grid_ - 1);
    x_.reshape(1, grid_ + 1);
    mass_.assign(grid_ + 1, 0.0);
    for (std::size_t n = 0; n < grid_; ++n) x_(0, n) = low_ + width_ * static_cast<double>(n);
    x_(0, grid_) = model_.initial[0];
    if (model_.initial_law) {
      const double m = model_.initial_law->mean(0), v = model_.initial_law->covariance(0, 0);
      for (std::size_t n = 0; n < grid_; ++n)
        mass_[n] =
            width_ * std::exp(-std::pow(x_(0, n) - m, 2) / (2 * v)) / std::sqrt(2 * std::numbers::pi * v);
    } else {
      mass_[grid_] = 1;
    }
    h_ = drift_ = sigma_ = derivative_ = Batch(1, grid_ + 1);
    model_.fields->ito_drift(x_, drift_);
    model_.fields->diffusion(x_, sigma_);
    if (model_.observation != ObservationKind::continuous) return;
    model_.fields->sensor(x_, h_);
    model_.fields->sensor_derivative(x_, derivative_);
  }

  void weigh(const std::vector<double>& y) {
    if (y.empty() || model_.observation != ObservationKind::discrete) return;
    std::vector<double> term(x_.nodes());
    model_.density->log_density(y, x_, term);
    for (std::size_t n = 0; n < term.size(); ++n) mass_[n] *= std::exp(term[n]);
  }

  double log_weight(const ObservationWindow& w, std::size_t n, std::size_t to) const {
    if (model_.observation != ObservationKind::continuous) return 0;
    const double s = w.length(), D = w.increment[0], a = h_(0, n), b = h_(0, to), G = derivative_(0, n);
    if (functional_ == FunctionalMethod::picard) return a * D - s / 2 * a * a;
    const double quadratic = s / 6 * (a * a + a * b + b * b);
    if (functional_ == FunctionalMethod::trapezoid) return (a + b) / 2 * D - quadratic;
    const double c = w.bridge_start[0] * a + w.bridge_end[0] * b, s2 = s * s, s3 = s2 * s;
    const double R = s3 / 45 * (a * a + b * b) + 7 * s3 / 180 * a * b;
    const double theta = 1 / (1 + s2 / (std::numbers::pi * std::numbers::pi) * G * G);
    const double M = theta * (w.covariation[0] - s2 / 6 - 2 * c + R);
    return a * D + (b - a) * w.integral[0] / s - quadratic + G * G * M / 2;
  }

  void move(const ObservationWindow& w) {
    std::vector<double> next(grid_ + 1, 0.0);
    for (std::size_t n = 0; n <= grid_; ++n) {
      if (mass_[n] == 0) continue;
      const double m = x_(0, n) + drift_(0, n) * w.length(),
                   sd = std::abs(sigma_(0, n)) * std::sqrt(w.length());
      for (std::size_t to = 0; to < grid_; ++to) {
        const double z = (x_(0, to) - m) / sd;
        if (std::abs(z) < 9)
          next[to] += mass_[n] * width_ / (sd * std::sqrt(2 * std::numbers::pi)) *
                      std::exp(-z * z / 2 + log_weight(w, n, to));
      }
    }
    mass_.swap(next);
  }

  const Model& model_;
  FunctionalMethod functional_;
  double low_, high_, width_ = 0;
  std::size_t grid_ = 0;
  Batch x_, h_, drift_, sigma_, derivative_;
  std::vector<double> mass_;
};

}  // namespace wienertree::papers
