#include "wienertree/filter/family_substeps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wienertree {

double families_of(const Generation& parents, const Generation& children, const CubatureFormula& formula,
                   Families& out) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::size_t N = parents.size(), c = formula.paths.size();
  const std::span<const double> x = children.states.component(0);
  out.clear();
  out.shape.resize(N);
  const double largest = *std::max_element(parents.log_weight.begin(), parents.log_weight.end());
  double mass = 0, skewness = 0, kurtosis = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const auto share = [&](std::size_t j) {
      return children.log_weight[j * N + i] > -infinity ? formula.paths[j].weight : 0.0;
    };
    double sum = 0, mean = 0, m2 = 0, m3 = 0, m4 = 0;
    for (std::size_t j = 0; j < c; ++j) {
      sum += share(j);
      mean += share(j) * (x[j * N + i] - x[i]);
    }
    mean = sum > 0 ? x[i] + mean / sum : x[i];
    for (std::size_t j = 0; j < c; ++j) {
      const double off = x[j * N + i] - mean, square = share(j) * off * off;
      m2 += square;
      m3 += square * off;
      m4 += square * off * off;
    }
    const double variance = sum > 0 ? m2 / sum : 0, sd = std::sqrt(variance);
    double k3 = 0, k4 = 0;
    if (sd > 0) {
      k3 = m3 / sum / (variance * sd);
      k4 = m4 / sum / (variance * variance) - 3;
    }
    out.add(sum > 0 ? parents.log_weight[i] + std::log(sum) : -infinity, mean, sd);
    out.shape[i] = FamilyShape::of(k3, k4);
    const double w = std::exp(parents.log_weight[i] - largest);
    mass += w;
    skewness += w * k3 * k3;
    kurtosis += w * k4 * k4;
  }
  return std::sqrt(std::max(skewness, kurtosis) / mass);
}

void graded_steps(double gap, double last, double ratio, double longest, std::vector<double>& steps) {
  steps.clear();
  std::vector<double> coarse;
  if (last < gap) {
    // Time left gap theta^k after step k, the smallest number of steps K - 1 with theta >= ratio.
    const auto before = static_cast<int>(std::ceil(std::log(last / gap) / std::log(ratio) - 1e-9));
    const double theta = std::pow(last / gap, 1.0 / std::max(before, 1));
    double left = gap;
    for (int k = 1; k <= std::max(before, 1); ++k) {
      const double next = k >= before ? last : gap * std::pow(theta, k);
      coarse.push_back(left - next);
      left = next;
    }
  }
  coarse.push_back(std::min(last, gap));
  for (const double s : coarse) {
    const auto parts = static_cast<std::size_t>(std::max(1.0, std::ceil(s / longest * (1 - 1e-9))));
    for (std::size_t k = 0; k < parts; ++k) steps.push_back(s / static_cast<double>(parts));
  }
}

double grading_ratio(int degree) { return degree <= 5 ? 0.85 : degree <= 9 ? 0.75 : 0.65; }

}  // namespace wienertree
