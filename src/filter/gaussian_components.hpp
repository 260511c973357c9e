#pragma once
/// A measure that is a sum of Gaussians, as a structure of arrays.
#include <vector>

#include "wienertree/numeric/batch.hpp"
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

}  // namespace wienertree
