#include "wienertree/thinning/recombination/partition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {
namespace {

constexpr std::size_t block = 64;

WIENERTREE_CLONES double total(const double* w, std::size_t n) { return lane_total(w, n); }

WIENERTREE_CLONES double weighted_total(const double* w, const double* z, std::size_t n) {
  return lane_dot(w, z, n);
}

// square[j] becomes square[j]^(power/2), power >= 1.
[[gnu::always_inline]] inline void half_powers(double* square, std::size_t n, int power) {
  std::array<double, block> base;
  for (std::size_t j = 0; j < n; ++j) base[j] = square[j];
  if (power % 2 == 1)
    for (std::size_t j = 0; j < n; ++j) square[j] = std::sqrt(square[j]);
  for (int k = power % 2 == 1 ? 1 : 2; k + 2 <= power; k += 2)
    for (std::size_t j = 0; j < n; ++j) square[j] *= base[j];
}

// moment[i] += sum_j w_j |z_j^i - mean^i|^power, and moment[d] += sum_j w_j |z_j - mean|^power, for one
// block.
WIENERTREE_CLONES void add_moments(const double* z, std::size_t stride, std::size_t d, const double* w,
                                   const double* mean, std::size_t n, int power, double* moment) {
  std::array<double, block> distance, along;
  for (std::size_t j = 0; j < n; ++j) distance[j] = 0;
  const auto add = [&](std::array<double, block>& square, double& sum) {
    half_powers(square.data(), n, power);
    sum += lane_dot(w, square.data(), n);
  };
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double dz = z[i * stride + j] - mean[i];
      along[j] = dz * dz;
      distance[j] += along[j];
    }
    add(along, moment[i]);
  }
  add(distance, moment[d]);
}

// Stable: values of `left` to the front.
template <class T>
void move_to_front(T* values, const std::uint8_t* left, std::size_t n, T* scratch) {
  std::size_t l = 0, r = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const T value = values[j];
    values[l] = value;
    scratch[r] = value;
    l += left[j];
    r += 1u - left[j];
  }
  std::copy_n(scratch, r, values + l);
}

std::size_t fewest_of(const Patch& patch) { return std::max<std::size_t>(patch.size() / 32, 1); }

bool smaller_error(const Patch& a, const Patch& b) {
  return a.error < b.error || (a.error == b.error && a.begin > b.begin);
}

}  // namespace

void SpacePartition::reset(std::size_t dimension, std::size_t points) {
  dimension_ = dimension;
  points_ = points;
  z_.resize(dimension * points);
  for (std::vector<double>* v : {&weight_, &scratch_}) v->resize(points);
  moment_.resize(dimension + 1);
  mean_.resize(dimension);
  order_.resize(points);
  order_scratch_.resize(points);
  left_.resize(points);
}

void SpacePartition::scale() {
  for (std::size_t i = 0; i < dimension_; ++i) {
    const std::span<double> z = component(i);
    const auto [mean, deviation] = mean_deviation(z.data(), weight_.data(), points_);
    const double factor = deviation > 0 ? 1 / deviation : 0;
    for (double& x : z) x = (x - mean) * factor;
  }
}

void SpacePartition::cut(int degree, std::size_t nodes_per_patch, std::size_t budget) {
  scale();
  std::iota(order_.begin(), order_.end(), 0u);
  patches_.clear();
  open_.clear();
  open_.push_back(measure(0, points_, degree));
  const auto nodes = [&](std::size_t points) { return std::min(points, nodes_per_patch); };
  std::size_t used = nodes(points_);
  while (!open_.empty()) {
    std::pop_heap(open_.begin(), open_.end(), smaller_error);
    const Patch patch = open_.back();
    open_.pop_back();
    // The cheapest cut possible, one point or 1/32 of them on one side, adds `fewest_more` nodes.
    const std::size_t fewest_more =
        patch.size() <= nodes_per_patch
            ? 0
            : std::min({patch.size() - nodes_per_patch, fewest_of(patch), nodes_per_patch});
    if (fewest_more == 0 || !(patch.error > 0) || used + fewest_more > budget) {
      patches_.push_back(patch);
      continue;
    }
    const std::size_t middle = divide(patch);
    const std::size_t cost =
        used - nodes(patch.size()) + nodes(middle - patch.begin) + nodes(patch.end - middle);
    if (middle == patch.begin || middle == patch.end || cost > budget) {
      patches_.push_back(patch);
      continue;
    }
    used = cost;
    for (const auto& [begin, end] : {std::pair{patch.begin, middle}, std::pair{middle, patch.end}}) {
      open_.push_back(measure(begin, end, degree));
      std::push_heap(open_.begin(), open_.end(), smaller_error);
    }
  }
  std::sort(patches_.begin(), patches_.end(),
            [](const Patch& a, const Patch& b) { return a.begin < b.begin; });
}

Patch SpacePartition::measure(std::size_t begin, std::size_t end, int degree) {
  Patch patch{begin, end};
  const double* w = weight_.data() + begin;
  const std::size_t n = end - begin;
  const double mass = total(w, n);
  if (!(mass > 0)) return patch;
  for (std::size_t i = 0; i < dimension_; ++i)
    mean_[i] = weighted_total(w, z_.data() + i * points_ + begin, n) / mass;
  std::fill(moment_.begin(), moment_.end(), 0.0);
  for (std::size_t first = begin; first < end; first += block)
    add_moments(z_.data() + first, points_, dimension_, weight_.data() + first, mean_.data(),
                std::min(block, end - first), degree + 1, moment_.data());
  patch.error = moment_[dimension_];
  patch.axis = static_cast<std::size_t>(
      std::max_element(moment_.begin(), moment_.begin() + static_cast<std::ptrdiff_t>(dimension_)) -
      moment_.begin());
  patch.cut = mean_[patch.axis];
  return patch;
}

/// Reorders the patch; returns where its second part begins.
std::size_t SpacePartition::divide(const Patch& patch) {
  const std::span<const double> z = component(patch.axis).subspan(patch.begin, patch.size());
  const std::size_t fewest = fewest_of(patch);
  const auto at_most = [&](double cut) {
    return static_cast<std::size_t>(std::count_if(z.begin(), z.end(), [&](double x) { return x <= cut; }));
  };
  const auto nth = [&](std::size_t k) {
    std::copy(z.begin(), z.end(), scratch_.begin());
    const auto at = scratch_.begin() + static_cast<std::ptrdiff_t>(k);
    std::nth_element(scratch_.begin(), at, scratch_.begin() + static_cast<std::ptrdiff_t>(z.size()));
    return *at;
  };
  double cut = patch.cut;
  const std::size_t left = at_most(cut);
  if (left < fewest)
    cut = nth(fewest - 1);
  else if (patch.size() - left < fewest)
    cut = nth(patch.size() - fewest - 1);
  // Ties may still put all points on the left: then those at the largest value go to the right.
  return move_left(patch, cut, at_most(cut) < patch.size());
}

std::size_t SpacePartition::move_left(const Patch& patch, double cut, bool inclusive) {
  const std::size_t n = patch.size(), begin = patch.begin;
  const double* z = component(patch.axis).data() + begin;
  std::size_t count = 0;
  for (std::size_t j = 0; j < n; ++j) {
    left_[j] = (inclusive ? z[j] <= cut : z[j] < cut) ? 1 : 0;
    count += left_[j];
  }
  for (std::size_t i = 0; i < dimension_; ++i)
    move_to_front(component(i).data() + begin, left_.data(), n, scratch_.data());
  move_to_front(weight_.data() + begin, left_.data(), n, scratch_.data());
  move_to_front(order_.data() + begin, left_.data(), n, order_scratch_.data());
  return begin + count;
}

}  // namespace wienertree::recombination
