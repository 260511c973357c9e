#include "wienertree/tree/jacobi_transition.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/cubature/gauss_moments.hpp"

namespace wienertree {

namespace {

using Moments = std::array<long double, 9>;

// Those of (x_s - x)/h, by Taylor's series of the equations of the header over parts of s on which the matrix
// has a norm of at most 1: 22 terms leave 1e-21.
Moments moments(const JacobiProcess& process, double x, double s, double h, std::size_t highest) {
  const long double c = process.c, drift = (process.a + process.b * static_cast<long double>(x)) / h,
                    P = (x - process.lower) * static_cast<long double>(process.upper - x) / h / h,
                    Q = (process.upper + process.lower - 2 * static_cast<long double>(x)) / h;
  Moments diagonal{}, below{}, second{};
  long double norm = 0;
  for (std::size_t k = 1; k <= highest; ++k) {
    const auto i = static_cast<long double>(k);
    const long double pairs = i * (i - 1) * c / 2;
    diagonal[k] = i * process.b - pairs;
    below[k] = i * drift + pairs * Q;
    second[k] = pairs * P;
    norm = std::max(norm, std::abs(diagonal[k]) + std::abs(below[k]) + std::abs(second[k]));
  }
  const long double parts = std::max(1.0L, std::ceil(norm * s)), part = s / parts;
  Moments m{};
  m[0] = 1;
  for (long double done = 0; done < parts; ++done) {
    Moments term = m;
    for (int j = 1; j <= 22; ++j) {
      for (std::size_t k = highest; k > 0; --k)
        term[k] = (diagonal[k] * term[k] + below[k] * term[k - 1] + (k > 1 ? second[k] * term[k - 2] : 0)) *
                  part / j;
      term[0] = 0;
      for (std::size_t k = 1; k <= highest; ++k) m[k] += term[k];
    }
  }
  return m;
}

// E ((y - mean)/sd)^k from E y^k.
Moments standardised(const Moments& m, long double sd, std::size_t highest) {
  Moments result{};
  long double scale = 1;
  for (std::size_t k = 0; k <= highest; ++k, scale *= sd) {
    long double binomial = 1, power = 1;  // of k over i, and (-mean)^i
    for (std::size_t i = 0; i <= k; ++i, power *= -m[1]) {
      result[k] += binomial * power * m[k - i];
      binomial *= static_cast<long double>(k - i) / static_cast<long double>(i + 1);
    }
    result[k] /= scale;
  }
  result[1] = 0;
  return result;
}

std::size_t rule_nodes(int degree) { return static_cast<std::size_t>(std::clamp((degree + 1) / 2, 2, 4)); }

}  // namespace

std::size_t JacobiTransition::branches(int degree) const { return rule_nodes(degree); }

std::array<JacobiTransition::Child, 4> JacobiTransition::children(double x, int degree, double s) const {
  const auto& [a, b, c, lower, upper] = process_;
  const std::size_t q = rule_nodes(degree), highest = 2 * q - 1;
  x = std::clamp(x, lower, upper);
  const double drift = (a + b * x) * s;
  // On this scale no coefficient of the equations is large against 1/s: near a bound the law has the width c s Q.
  const double h = std::min(upper - lower, std::abs(drift) + std::sqrt(c * s * (x - lower) * (upper - x)) +
                                               c * s * std::abs(upper + lower - 2 * x));
  std::array<Child, 4> result{};
  const Moments m = moments(process_, x, s, h, highest);
  const long double variance = m[2] - m[1] * m[1];
  const auto place = [&, low = lower, high = upper](long double y) {
    return std::clamp(static_cast<double>(x + h * y), low, high);
  };
  if (!(variance > 1e-24L)) {  // a bound that is not left
    result.fill({place(m[1]), 1 / static_cast<double>(q)});
    return result;
  }
  const long double sd = std::sqrt(variance);
  const GaussRule rule = gauss_rule(standardised(m, sd, highest), q);
  for (std::size_t k = 0; k < q; ++k) {
    const std::size_t node = std::min(k, rule.size - 1);
    const double share = node + 1 == rule.size ? static_cast<double>(q - node) : 1;
    result[k] = {place(m[1] + sd * rule.node[node]), rule.weight[node] / share};
  }
  return result;
}

void JacobiTransition::grow(const Generation& parents, int degree, double s, ThreadPool* threads,
                            Generation& children) const {
  const std::size_t count = branches(degree);
  reserve_children(parents, count, s, "Jacobi's transition", children);
  constexpr std::size_t block = 16;
  for_blocks(threads, parents.size(), block, [&](std::size_t first, std::size_t in_block, std::size_t) {
    for (std::size_t n = first; n < first + in_block; ++n) {
      const std::array<Child, 4> fan = this->children(parents.states(0, n), degree, s);
      for (std::size_t branch = 0; branch < count; ++branch) {
        const double log_weight = parents.log_weight[n] + std::log(fan[branch].weight);
        children.states(0, place_child(parents, n, branch, log_weight, children)) = fan[branch].x;
      }
    }
  });
}

}  // namespace wienertree
