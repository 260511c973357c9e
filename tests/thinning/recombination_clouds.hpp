#pragma once
/// Measures for the tests of recombination, and what is to be kept of them.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "wienertree/thinning/recombination/polynomials.hpp"
#include "wienertree/thinning/recombination/recombination.hpp"

namespace wienertree::recombination_test {

struct Cloud {
  Batch x;
  std::vector<double> log_weight;
  std::size_t size() const { return log_weight.size(); }
  Sites sites() const { return {x.view(), log_weight, 0}; }
};

/// Standard normal points, log-weights uniform on [-depth, 0].
inline Cloud normal_cloud(std::size_t d, std::size_t n, std::uint64_t seed, double depth = 3) {
  Cloud c{Batch(d, n), std::vector<double>(n)};
  const RandomStream random{seed};
  for (std::size_t i = 0; i < d; ++i) random.normals(i * (n + 1), c.x.component(i));
  random.uniforms((d + 1) * (n + 1), c.log_weight);
  for (double& l : c.log_weight) l *= -depth;
  return c;
}

/// The measure that a selection stands for.
inline Cloud selected(const Cloud& c, const Selection& s) {
  const std::size_t d = c.x.components(), n = s.site.size();
  Cloud out{Batch(d, n), s.log_weight};
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t k = 0; k < n; ++k)
      out.x(i, k) = s.moved_states.nodes() ? s.moved_states(i, k) : c.x(i, s.site[k]);
  return out;
}

inline double log_mass(const Cloud& c) {
  const double largest = *std::max_element(c.log_weight.begin(), c.log_weight.end());
  double sum = 0;
  for (const double l : c.log_weight) sum += std::exp(l - largest);
  return largest + std::log(sum);
}

/// Coordinates of a bounding box: component i of x is centre + half z, z in [-1,1] (half = 0: left out).
struct Box {
  std::vector<double> centre, half;
  explicit Box(const Cloud& c) {
    for (std::size_t i = 0; i < c.x.components(); ++i) {
      const auto x = c.x.component(i);
      const auto [low, high] =
          std::minmax_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(c.size()));
      centre.push_back((*low + *high) / 2);
      half.push_back((*high - *low) / 2);
    }
  }
};

/// Integrals of the Legendre products of degree at most r in the coordinates of `box` against the measure
/// divided by exp(log_scale), summed in long double.
inline std::vector<double> moments(const Cloud& c, const Box& box, int degree, double log_scale) {
  const std::size_t d = c.x.components();
  const recombination::PolynomialBasis basis(d, degree);
  constexpr std::size_t block = recombination::PolynomialBasis::block;
  std::vector<double> z(d), scratch(basis.scratch_size()), value(basis.size() * block);
  std::vector<long double> sum(basis.kept());
  for (std::size_t j = 0; j < c.size(); ++j) {
    for (std::size_t i = 0; i < d; ++i)
      z[i] = box.half[i] > 0 ? (c.x(i, j) - box.centre[i]) / box.half[i] : 0;
    const double one = 1;
    basis.evaluate(z.data(), 1, &one, 1, scratch.data(), value.data());
    const long double w = std::exp(static_cast<long double>(c.log_weight[j]) - log_scale);
    for (std::size_t a = 0; a < sum.size(); ++a) sum[a] += w * value[a * block];
  }
  return {sum.begin(), sum.end()};
}

/// Largest difference of the moments of two measures in the box of the first, relative to its mass.
inline double moment_difference(const Cloud& a, const Cloud& b, int degree) {
  const Box box(a);
  const double mass = log_mass(a);
  const auto m = moments(a, box, degree, mass), n = moments(b, box, degree, mass);
  double worst = 0;
  for (std::size_t k = 0; k < m.size(); ++k) worst = std::max(worst, std::abs(m[k] - n[k]));
  return worst;
}

inline Selection recombine(const Cloud& c, int degree, std::size_t budget) {
  Selection s;
  make_recombination(degree)->thin(c.sites(), budget, {}, s);
  return s;
}

/// Empty, or what is wrong with a selection apart from its moments.
inline std::string defect(const Cloud& c, const Selection& s, std::size_t budget) {
  const std::size_t n = s.site.size();
  if (n == 0 || n > budget) return "keeps " + std::to_string(n) + " nodes of " + std::to_string(budget);
  if (s.log_weight.size() != n) return "log-weights missing";
  if (s.moved_states.nodes() != 0 && s.moved_states.nodes() != n) return "moved states missing";
  if (!s.count.empty()) return "counts";
  auto sorted = s.site;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return "a site twice";
  if (sorted.back() >= c.size()) return "a site that does not exist";
  for (const double l : s.log_weight)
    if (!std::isfinite(l)) return "log-weight " + std::to_string(l);
  for (const std::uint32_t m : s.site)
    if (c.log_weight[m] == -std::numeric_limits<double>::infinity()) return "a site of weight 0";
  if (!(s.discarded >= 0) || !std::isfinite(s.discarded)) return "discarded " + std::to_string(s.discarded);
  // exp(log-weight) carries the rounding of the log-weights themselves: 4 epsilon max|l|, and that of n sums.
  double largest = 1;
  for (const double l : c.log_weight)
    if (std::isfinite(l)) largest = std::max(largest, std::abs(l));
  const double lost = log_mass(selected(c, s)) - log_mass(c);
  if (std::abs(lost) > 1e-15 * (4 * largest + 100))
    return "log mass changed by " + std::to_string(lost * 1e15) + "e-15";
  return "";
}

}  // namespace wienertree::recombination_test
