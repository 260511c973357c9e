#include "wienertree/thinning/recombination/caratheodory.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {
namespace {

std::size_t first_of(std::size_t group, std::size_t groups, std::size_t points) {
  return group * points / groups;
}

// Adds the values of points first..last-1 to column `group` of the moments.
WIENERTREE_CLONES void add_values(const double* values, std::size_t block, std::size_t first,
                                  std::size_t last, std::size_t size, std::size_t stride, double* group) {
  for (std::size_t a = 0; a < size; ++a) {
    const double* value = values + a * block;
    group[a * stride] += lane_sum(first, last, [&](std::size_t j) { return value[j]; });
  }
}

// Moments of the groups become those of their barycentres: every row is divided by the first, the weights.
WIENERTREE_CLONES void divide_by_first(double* moments, std::size_t groups, std::size_t size,
                                       std::size_t stride) {
  for (std::size_t a = 1; a < size; ++a)
    for (std::size_t g = 0; g < groups; ++g) moments[a * stride + g] /= moments[g];
  for (std::size_t g = 0; g < groups; ++g) moments[g] = 1;
}

WIENERTREE_CLONES void scale_rows(double* rows, std::size_t groups, std::size_t stride,
                                  std::span<const double> factor) {
  for (std::size_t f = 0; f < factor.size(); ++f)
    for (std::size_t g = 0; g < groups; ++g) rows[f * stride + g] *= factor[f];
}

}  // namespace

void PatchPoints::reserve(std::size_t d, std::size_t most) {
  dimension = d;
  stride = most;
  grow(z, d * most);
  grow(weight, most);
  if (label.size() < most) label.resize(most);
}

double Caratheodory::reduce(const PolynomialBasis& basis, std::span<const double> importance,
                            PatchPoints& points) {
  assert(basis.dimension() == points.dimension && points.count >= 1 &&
         importance.size() == basis.size() - basis.kept());
  const std::size_t q = basis.kept(), further = basis.size() - q;
  const auto total_weight = [&] {
    return std::accumulate(points.weight.begin(),
                           points.weight.begin() + static_cast<std::ptrdiff_t>(points.count), 0.0);
  };
  const double total = total_weight();
  discrepancy_.assign(further, 0);
  grow(scratch_, basis.scratch_size());
  grow(values_, basis.size() * PolynomialBasis::block);
  while (points.count > q) {
    const std::size_t groups = std::min(points.count, 2 * q);
    grow(moments_, padded(groups) * basis.size());
    group_moments(basis, points, groups);
    weight_.assign(moments_.begin(), moments_.begin() + static_cast<std::ptrdiff_t>(groups));
    divide_by_first(moments_.data(), groups, basis.size(), padded(groups));
    scale_rows(moments_.data() + q * padded(groups), groups, padded(groups), importance);
    before_ = weight_;
    step_.reduce(moments_.data(), groups, q, basis.size(), weight_, discrepancy_);
    const std::size_t before = points.count;
    keep_groups(points, groups, 1e-300 * total);
    if (points.count == before) throw RunError("no point could be left out", "recombination");
  }
  const double scale = total / total_weight();
  for (std::size_t j = 0; j < points.count; ++j) points.weight[j] *= scale;
  double change = 0;
  for (const double e : discrepancy_) change += std::abs(e);
  return change / total;
}

void Caratheodory::group_moments(const PolynomialBasis& basis, const PatchPoints& points,
                                 std::size_t groups) {
  const std::size_t n = points.count, size = basis.size(), stride = padded(groups);
  std::fill_n(moments_.begin(), stride * size, 0.0);
  std::size_t group = 0;
  for (std::size_t begin = 0; begin < n; begin += PolynomialBasis::block) {
    const std::size_t end = std::min(begin + PolynomialBasis::block, n);
    basis.evaluate(points.z.data() + begin, points.stride, points.weight.data() + begin, end - begin,
                   scratch_.data(), values_.data());
    for (std::size_t first = begin; first < end;) {
      const std::size_t group_end = first_of(group + 1, groups, n), last = std::min(group_end, end);
      add_values(values_.data(), PolynomialBasis::block, first - begin, last - begin, size, stride,
                 moments_.data() + group);
      first = last;
      if (first == group_end) ++group;
    }
  }
}

void Caratheodory::keep_groups(PatchPoints& points, std::size_t groups, double smallest) {
  const std::size_t n = points.count;
  std::size_t kept = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    const double ratio = weight_[g] / before_[g];
    if (!(ratio > 0)) continue;
    for (std::size_t j = first_of(g, groups, n); j < first_of(g + 1, groups, n); ++j) {
      const double w = points.weight[j] * ratio;
      if (w < smallest) continue;
      for (std::size_t i = 0; i < points.dimension; ++i)
        points.z[i * points.stride + kept] = points.z[i * points.stride + j];
      points.weight[kept] = w;
      points.label[kept] = points.label[j];
      ++kept;
    }
  }
  points.count = kept;
}

}  // namespace wienertree::recombination
