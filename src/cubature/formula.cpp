#include "wienertree/cubature/formula.hpp"

#include <cassert>
#include <cmath>

namespace wienertree {

void scaled_increments(const CubaturePath& path, std::size_t segment, double s, std::span<double> out) {
  assert(out.size() == static_cast<std::size_t>(path.increments.rows()));
  const auto column = path.increments.col(static_cast<Eigen::Index>(segment));
  const double root = std::sqrt(s);
  if (!path.degree.empty()) {
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = std::pow(root, path.degree[i]) * column(static_cast<Eigen::Index>(i));
    return;
  }
  out[0] = s * column(0);
  for (std::size_t i = 1; i < out.size(); ++i) out[i] = root * column(static_cast<Eigen::Index>(i));
}

}  // namespace wienertree
