#pragma once
/// A measure that is a sum of Gaussians, as a structure of arrays.
#include <cmath>
#include <span>
#include <vector>

#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/log_weights.hpp"
#include "wienertree/numeric/state_archive.hpp"

namespace wienertree {

/// sum_n exp(log_weight_n) N(mean_n, covariance_n) over d states; a clock is none of them.
struct GaussianComponents {
  std::vector<double> log_weight;  ///< N
  Batch mean;                      ///< d x N
  Batch covariance;                ///< d*d x N, component i*d + j

  std::size_t size() const { return log_weight.size(); }
  std::size_t states() const { return mean.components(); }
  /// Values are unspecified afterwards.
  void reshape(std::size_t d, std::size_t n) {
    log_weight.resize(n);
    mean.reshape(d, n);
    covariance.reshape(d * d, n);
  }
  void swap(GaussianComponents& other) noexcept {
    log_weight.swap(other.log_weight);
    mean.swap(other.mean);
    covariance.swap(other.covariance);
  }
  void exchange(StateArchive& archive) { archive(log_weight, mean, covariance); }
};

/// The root mean square of `values`, one a component, under the components' weights.
inline double root_mean_square(const GaussianComponents& c, std::span<const double> values) {
  const double largest = largest_log_weight(c.log_weight).value;
  double mass = 0, sum = 0;
  for (std::size_t n = 0; n < c.size(); ++n) {
    const double w = std::exp(c.log_weight[n] - largest);
    mass += w;
    sum += w * values[n] * values[n];
  }
  return std::sqrt(sum / mass);
}

}  // namespace wienertree
