#pragma once
/// A filter on the line by quadrature, for signals whose transition is Gaussian in some coordinate z: the
/// oracle of conditioned families.
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

namespace wienertree {

/// z -> N(F z + f, Q) from one observation to the next.
struct GaussianStep {
  double F, f, Q;
};

/// Trapezoidal rule on intervals that hold all but e^-40 of each posterior: for densities that are analytic
/// and vanish at the ends of an interval it converges geometrically, and 600 points on 20 standard deviations
/// are exact to 1e-12.
class LineOracle {
 public:
  using Intervals = std::vector<std::pair<double, double>>;
  /// Start N(mean, variance); variance 0 for a point.
  LineOracle(double mean, double variance) : mean_(mean), variance_(variance) {}

  void move(GaussianStep step) {
    if (point_.empty()) {
      mean_ = step.F * mean_ + step.f;
      variance_ = step.F * step.F * variance_ + step.Q;
    } else {
      step_ = step;
      moved_ = true;
    }
  }
  /// @param likelihood log p(y | z)  @param where intervals outside which likelihood or prediction are
  /// negligible
  void observe(const std::function<double(double)>& likelihood, const Intervals& where) {
    constexpr std::size_t points = 600;
    std::vector<double> z, log_mass;
    for (const auto& [low, high] : where)
      for (std::size_t k = 0; k < points; ++k) {
        const double width = (high - low) / (points - 1);
        z.push_back(low + static_cast<double>(k) * width);
        log_mass.push_back(log_prediction(z.back()) + likelihood(z.back()) + std::log(width));
      }
    double largest = -INFINITY, sum = 0;
    for (const double v : log_mass) largest = std::max(largest, v);
    for (const double v : log_mass) sum += std::exp(v - largest);
    log_evidence_ += largest + std::log(sum);
    for (double& v : log_mass) v = std::exp(v - largest) / sum;
    point_ = std::move(z);
    mass_ = std::move(log_mass);
    moved_ = false;
  }
  double log_evidence() const { return log_evidence_; }
  /// Posterior mean of phi(z).
  double expectation(const std::function<double(double)>& phi) const {
    double sum = 0;
    for (std::size_t k = 0; k < point_.size(); ++k) sum += mass_[k] * phi(point_[k]);
    return sum;
  }
  /// Where all but e^-40 of the prediction lies, for likelihoods that are wide.
  std::pair<double, double> range() const {
    if (point_.empty()) return {mean_ - 9 * std::sqrt(variance_), mean_ + 9 * std::sqrt(variance_)};
    const double s = 9 * std::sqrt(step_.Q);
    return {step_.F * point_.front() + step_.f - s, step_.F * point_.back() + step_.f + s};
  }

 private:
  static double log_normal(double off, double variance) {
    return -off * off / (2 * variance) - std::log(2 * std::numbers::pi * variance) / 2;
  }
  double log_prediction(double z) const {
    if (point_.empty()) return log_normal(z - mean_, variance_);
    double sum = 0;
    for (std::size_t k = 0; k < point_.size(); ++k)
      if (mass_[k] > 0) sum += mass_[k] * std::exp(log_normal(z - step_.F * point_[k] - step_.f, step_.Q));
    return std::log(sum);
  }

  double mean_, variance_, log_evidence_ = 0;
  GaussianStep step_{1, 0, 0};
  bool moved_ = false;
  std::vector<double> point_, mass_;
};

}  // namespace wienertree
