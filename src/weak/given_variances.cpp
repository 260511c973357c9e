#include "wienertree/weak/given_variances.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace wienertree {

GivenVariances::GivenVariances(SquareRootStructure structure, const std::vector<double>& start, double T)
    : structure_(std::move(structure)), states_(start.size()) {
  const SquareRootStructure::Price& price = *structure_.price;
  const double u = start[price.state];
  mean_ = (price.logarithmic ? u : std::log(u)) + price.rate * T;
  for (std::size_t k = 0; k < structure_.components.size(); ++k) {
    const auto& [state, process, shift] = structure_.components[k];
    const double slope = price.correlated[k] / std::sqrt(process.c);
    mean_ -= slope * (start[state] + shift + process.a * T);
    of_component_.push_back(slope);
    of_integral_.push_back(price.drift[k] - slope * process.b);
  }
}

NormalLaw GivenVariances::operator()(ConstBatchView leaves, std::size_t n) const {
  const SquareRootStructure::Price& price = *structure_.price;
  double mean = mean_, variance = 0;
  for (std::size_t k = 0; k < of_component_.size(); ++k) {
    const std::size_t state = structure_.components[k].state;
    const double v = leaves(state < price.state ? state : state - 1, n) + structure_.components[k].shift;
    const double I = leaves(states_ - 1 + k, n);
    mean += of_component_[k] * v + of_integral_[k] * I;
    variance += price.independent[k] * I;
  }
  return {mean, std::sqrt(std::max(0.0, variance))};
}

}  // namespace wienertree
