#include "wienertree/filter/fokker_planck.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace wienertree {
namespace {

constexpr std::size_t half_width = 4, stencil = 8;

// Adds to the matrix the flux through the face between nodes i and i+1, which leaves cell i and enters i+1.
class FluxRows {
 public:
  FluxRows(const LineGrid& grid, BandedMatrix& L) : width_(grid.width), L_(L) {}
  void add(std::size_t face, std::size_t node, double coefficient) {
    L_(face, node) -= coefficient / width_;
    L_(face + 1, node) += coefficient / width_;
  }

 private:
  double width_;
  BandedMatrix& L_;
};

struct LagrangeWeights {
  std::size_t first;
  std::array<double, stencil> weight;
};

// The polynomial through the nodes first .. first+7 at x: weights prod_{l != j} (z - l)/(j - l), z = x's
// distance from the first node in cells.
LagrangeWeights lagrange(const LineGrid& grid, double x) {
  const double place = (x - grid.lower) / grid.width - 0.5;
  const double lowest = std::isfinite(place) ? std::floor(place) - (stencil / 2 - 1) : 0.0;
  LagrangeWeights out{};
  out.first = static_cast<std::size_t>(std::clamp(lowest, 0.0, static_cast<double>(grid.cells - stencil)));
  const double z = place - static_cast<double>(out.first);
  for (std::size_t j = 0; j < stencil; ++j) {
    double w = 1;
    for (std::size_t l = 0; l < stencil; ++l)
      if (l != j) w *= (z - static_cast<double>(l)) / (static_cast<double>(j) - static_cast<double>(l));
    out.weight[j] = w;
  }
  return out;
}

}  // namespace

std::vector<double> central_difference(std::size_t m) {
  std::vector<double> c;
  double ratio = 1;  // m!^2 / ((m-k)! (m+k)!)
  for (std::size_t k = 1; k <= m; ++k) {
    ratio *= static_cast<double>(m - k + 1) / static_cast<double>(m + k);
    c.push_back((k % 2 == 1 ? ratio : -ratio) / static_cast<double>(k));
  }
  return c;
}

void fokker_planck(const LineGrid& grid, std::span<const double> drift, std::span<const double> variance,
                   BandedMatrix& L) {
  const std::size_t n = grid.cells;
  assert(n > 2 * half_width && drift.size() == n && variance.size() == n);
  L.size = n;
  L.half_width = half_width;
  L.band.assign(n * (2 * half_width + 1), 0.0);
  std::array<std::vector<double>, half_width + 1> first_derivative;
  for (std::size_t m = 1; m <= half_width; ++m) first_derivative[m] = central_difference(m);
  FluxRows rows(grid, L);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const std::size_t m = std::min({half_width, i + 1, n - 1 - i});
    for (std::size_t k = 1; k <= m; ++k) {
      const double c = first_derivative[m][k - 1], d = 2 * c / static_cast<double>(k) / grid.width;
      for (std::size_t node = i + 1 - k; node <= i + k; ++node) rows.add(i, node, c * drift[node]);
      for (std::size_t l = 0; l < k; ++l) {
        rows.add(i, i + k - l, -d * variance[i + k - l] / 2);
        rows.add(i, i - l, d * variance[i - l] / 2);
      }
    }
  }
}

void interpolate(const LineGrid& from, std::span<const double> values, const LineGrid& to,
                 std::span<double> out) {
  for (std::size_t i = 0; i < to.cells; ++i) {
    const double x = to.node(i);
    out[i] = 0;
    if (x < from.lower || x > from.upper()) continue;
    const LagrangeWeights w = lagrange(from, x);
    for (std::size_t j = 0; j < stencil; ++j) out[i] += w.weight[j] * values[w.first + j];
  }
}

void deposit(const LineGrid& grid, double x, std::span<double> density) {
  const LagrangeWeights w = lagrange(grid, x);
  for (std::size_t j = 0; j < stencil; ++j) density[w.first + j] += w.weight[j] / grid.width;
}

}  // namespace wienertree
