#pragma once
#include <random>

#include "wienertree/cubature/formula.hpp"

namespace wienertree::testing {

/// Increments uniform in [-1, 1]; one in four is exactly zero, as in splitting paths.
inline CubaturePath random_path(int p, int segments, std::mt19937_64& engine) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  CubaturePath path{1.0, Eigen::MatrixXd::Zero(p + 1, segments)};
  for (double& increment : path.increments.reshaped()) {
    const double value = uniform(engine);
    if (uniform(engine) > -0.5) increment = value;
  }
  return path;
}

}  // namespace wienertree::testing
