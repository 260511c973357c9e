#include "wienertree/thinning/recombination/step.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/thinning/recombination/householder.hpp"

namespace wienertree::recombination {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Where the weights meet zero: W - s v >= 0 up to s = down, W + s v >= 0 up to s = up.
struct Meeting {
  double down, up;
  std::size_t at_down, at_up;
};

WIENERTREE_CLONES Meeting meet_zero(const double* v, const double* weight, std::size_t n, double* down,
                                    double* up) {
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, std::abs(v[i]));
  const double noise = 4 * epsilon * largest;
  for (std::size_t i = 0; i < n; ++i) {
    const double s = weight[i] / v[i];
    down[i] = v[i] > noise ? s : infinity;
    up[i] = v[i] < -noise ? -s : infinity;
  }
  const auto *at_down = std::min_element(down, down + n), *at_up = std::min_element(up, up + n);
  return {*at_down, *at_up, static_cast<std::size_t>(at_down - down), static_cast<std::size_t>(at_up - up)};
}

double squared_distance(const double* e, const double* change, std::size_t n, double s) {
  if (!std::isfinite(s)) return infinity;
  double sum = 0;
  for (std::size_t f = 0; f < n; ++f) sum += (e[f] - s * change[f]) * (e[f] - s * change[f]);
  return sum;
}

/// Null vectors 0..last are combined so that all but the last vanish at point `at`. The largest entry there
/// is the pivot: no multiplier exceeds 1.
WIENERTREE_CLONES void remove_point(double* null, std::size_t stride, std::size_t last, std::size_t at) {
  std::size_t pivot = last;
  for (std::size_t j = 0; j < last; ++j)
    if (std::abs(null[j * stride + at]) > std::abs(null[pivot * stride + at])) pivot = j;
  double* v = null + last * stride;
  if (pivot != last) std::swap_ranges(v, v + stride, null + pivot * stride);
  for (std::size_t j = 0; j < last; ++j) {
    double* w = null + j * stride;
    add_multiple(w, -w[at] / v[at], v, stride);
    w[at] = 0;
  }
}

}  // namespace

void CaratheodoryStep::reduce(const double* moments, std::size_t n, std::size_t kept, std::size_t size,
                              std::span<double> weight, std::span<double> discrepancy) {
  assert(weight.size() == n && discrepancy.size() == size - kept && kept <= size);
  points_ = n;
  stride_ = padded(n);
  grow(rows_, kept * stride_);
  std::copy_n(moments, kept * stride_, rows_.data());
  null_space(moments + kept * stride_, size - kept, factorise(kept));
  eliminate(weight, discrepancy);
}

std::size_t CaratheodoryStep::factorise(std::size_t rows) {
  const std::size_t most = std::min(points_, rows);
  grow(reflector_, most * stride_);
  grow(scale_, most);
  grow(norm_, rows);
  grow(norm_reference_, rows);
  const std::size_t rank = pivoted_householder(rows_.data(), rows, points_, stride_, reflector_.data(),
                                               scale_.data(), norm_.data(), norm_reference_.data());
  // Reflector k passes over the rows behind k, twice.
  operations_ +=
      static_cast<double>(rank) * static_cast<double>(2 * rows - rank) * static_cast<double>(stride_);
  return rank;
}

void CaratheodoryStep::null_space(const double* further_moments, std::size_t further, std::size_t rank) {
  nullity_ = points_ - rank;
  null_stride_ = stride_ + padded(further);
  grow(null_, nullity_ * null_stride_);
  last_columns(reflector_.data(), scale_.data(), rank, points_, stride_, null_.data(), null_stride_);
  integrate_further(null_.data(), nullity_, null_stride_, stride_, further_moments, further);
  operations_ += static_cast<double>(nullity_ * (2 * rank + further)) * static_cast<double>(stride_);
}

void CaratheodoryStep::eliminate(std::span<double> weight, std::span<double> discrepancy) {
  const std::size_t n = points_, further = discrepancy.size();
  grow(down_, n);
  grow(up_, n);
  for (std::size_t last = nullity_; last-- > 0;) {
    const double *v = null_.data() + last * null_stride_, *change = v + stride_;
    const Meeting m = meet_zero(v, weight.data(), n, down_.data(), up_.data());
    const bool down = squared_distance(discrepancy.data(), change, further, m.down) <=
                      squared_distance(discrepancy.data(), change, further, -m.up);
    const double s = down ? m.down : -m.up;
    if (!std::isfinite(s)) continue;
    const std::size_t at = down ? m.at_down : m.at_up;
    for (std::size_t i = 0; i < n; ++i) weight[i] = std::max(0.0, weight[i] - s * v[i]);
    weight[at] = 0;
    for (std::size_t f = 0; f < further; ++f) discrepancy[f] -= s * change[f];
    remove_point(null_.data(), null_stride_, last, at);
    operations_ += static_cast<double>(last) * static_cast<double>(null_stride_);
  }
}

}  // namespace wienertree::recombination
