#include "wienertree/filter/hermite_rule.hpp"

#include <cmath>

#include "wienertree/filter/expectation.hpp"

namespace wienertree {

HermiteRule hermite_rule(std::size_t n) {
  const GaussianCubature gauss = gauss_hermite(1, static_cast<int>(n));
  HermiteRule rule;
  for (std::size_t j = 0; j < n; ++j) {
    const double z = gauss.points(0, static_cast<Eigen::Index>(j));
    const double w = gauss.weights(static_cast<Eigen::Index>(j));
    rule.z.push_back(z);
    rule.weight.push_back(w);
    rule.log_weight.push_back(std::log(w));
    // sqrt(k + 1) h_{k+1} = z h_k - sqrt(k) h_{k-1}
    std::vector<double> h = {1, z};
    for (std::size_t k = 1; k + 1 < n; ++k)
      h.push_back((z * h[k] - std::sqrt(static_cast<double>(k)) * h[k - 1]) /
                  std::sqrt(static_cast<double>(k + 1)));
    rule.first.push_back(w * h[1]);
    rule.second.push_back(w * h[2]);
    rule.before_last.push_back(w * h[n - 2]);
    rule.last.push_back(w * h[n - 1]);
  }
  return rule;
}

}  // namespace wienertree
