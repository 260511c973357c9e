#include "wienertree/thinning/recombination/space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "wienertree/numeric/log_weights.hpp"
#include "wienertree/thinning/recombination/recombination.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {

void SpaceRecombination::reduce(ConstBatchView x, ConstBatchView cut_in, std::span<const double> log_weight,
                                int degree, std::size_t budget, ThreadPool* threads, KeptPoints& out) {
  const double largest = *std::max_element(log_weight.begin(), log_weight.end());
  partition_.reset(x.components(), x.nodes());
  for (std::size_t i = 0; i < x.components(); ++i)
    std::copy(cut_in.component(i).begin(), cut_in.component(i).end(), partition_.component(i).begin());
  const double total = relative_weights(log_weight, largest, partition_.weight().data());
  unit_.resize(x.components());
  for (std::size_t i = 0; i < unit_.size(); ++i) {
    const double deviation =
        mean_deviation(x.component(i).data(), partition_.weight().data(), x.nodes()).deviation;
    unit_[i] = deviation > 0 ? deviation : 1;
  }
  const std::size_t most = moment_number(x.components(), degree, budget);
  partition_.cut(degree, most, budget);

  const std::span<const Patch> patches = partition_.patches();
  std::size_t room = 0;
  first_.clear();
  for (const Patch& patch : patches) {
    first_.push_back(room);
    room += std::min(patch.size(), most);
  }
  out.point.resize(room);
  out.log_weight.resize(room);
  result_.resize(patches.size());
  const std::size_t workers = threads == nullptr ? 1 : threads->size();
  if (reduction_.size() < workers) reduction_.resize(workers);
  const auto reduce_patch = [&](std::size_t k, std::size_t thread) {
    const std::size_t some = std::min(patches[k].size(), most);
    const PatchRoom room_of_patch{std::span(out.point).subspan(first_[k], some),
                                  std::span(out.log_weight).subspan(first_[k], some)};
    result_[k] = reduction_[thread].reduce(partition_, x, unit_, patches[k], log_weight, degree, largest,
                                           room_of_patch);
  };
  if (threads != nullptr)
    threads->for_each(patches.size(), reduce_patch);
  else
    for (std::size_t k = 0; k < patches.size(); ++k) reduce_patch(k, 0);

  // Together, in the patches' order.
  std::size_t kept = 0;
  out.discarded = 0;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    std::copy_n(out.point.begin() + static_cast<std::ptrdiff_t>(first_[k]), result_[k].kept,
                out.point.begin() + static_cast<std::ptrdiff_t>(kept));
    std::copy_n(out.log_weight.begin() + static_cast<std::ptrdiff_t>(first_[k]), result_[k].kept,
                out.log_weight.begin() + static_cast<std::ptrdiff_t>(kept));
    kept += result_[k].kept;
    out.discarded += result_[k].discarded;
  }
  out.point.resize(kept);
  out.log_weight.resize(kept);
  out.discarded /= total;
}

PatchReduction::Result PatchReduction::reduce(const SpacePartition& partition, ConstBatchView x,
                                              std::span<const double> unit, const Patch& patch,
                                              std::span<const double> log_weight, int degree, double largest,
                                              PatchRoom out) {
  const auto order = partition.order().subspan(patch.begin, patch.size());
  const std::size_t d = partition.dimension(), q = moment_number(d, degree, patch.size());
  if (patch.size() <= q) {
    for (std::size_t t = 0; t < order.size(); ++t) {
      out.point[t] = order[t];
      out.log_weight[t] = log_weight[order[t]];
    }
    return {order.size(), 0.0};
  }
  // Weights relative to the patch's heaviest: a patch in the tail is reduced as well as any other.
  log_weight_.resize(patch.size());
  for (std::size_t t = 0; t < order.size(); ++t) log_weight_[t] = log_weight[order[t]];
  const double heaviest = *std::max_element(log_weight_.begin(), log_weight_.end());
  points_.reserve(d, patch.size());
  const double weight = relative_weights(log_weight_, heaviest, points_.weight.data());
  std::size_t n = 0;
  for (std::size_t t = 0; t < order.size(); ++t) {
    points_.weight[n] = points_.weight[t];
    points_.label[n] = static_cast<std::uint32_t>(t);
    n += points_.weight[n] > 0 ? 1 : 0;
  }
  points_.count = n;
  fill_box(x, unit, order);
  double change = 0;
  if (points_.dimension == 0 || degree == 0)
    change = keep_nearest_to_mean(weight);
  else {
    const PolynomialBasis& polynomials = basis(points_.dimension, degree);
    polynomials.taylor_weights({half_.data(), points_.dimension}, importance_);
    change = caratheodory_.reduce(polynomials, importance_, points_);
  }
  for (std::size_t j = 0; j < points_.count; ++j) {
    out.point[j] = order[points_.label[j]];
    out.log_weight[j] = heaviest + std::log(points_.weight[j]);
  }
  return {points_.count, change * weight * std::exp(heaviest - largest)};
}

/// The patch's components become coordinates on [-1,1], up to rounding; those that are constant are left out.
void PatchReduction::fill_box(ConstBatchView x, std::span<const double> unit,
                              std::span<const std::uint32_t> order) {
  std::size_t varying = 0;
  half_.resize(x.components());
  for (std::size_t i = 0; i < x.components(); ++i) {
    const std::span<const double> from = x.component(i);
    const std::span<double> z(points_.z.data() + varying * points_.stride, points_.count);
    for (std::size_t j = 0; j < z.size(); ++j) z[j] = from[order[points_.label[j]]];
    const auto [low, high] = std::minmax_element(z.begin(), z.end());
    const double half = *high / 2 - *low / 2, centre = *low + half;
    if (!(half > 0)) continue;
    // One affine map for all points. The centre's rounding leaves ends beyond 1, by as much as 1 where they are an ulp
    // apart; put back to 1 they would no longer keep the moments of where they are.
    for (double& value : z) value = (value - centre) / half;
    half_[varying++] = half / unit[i];
  }
  points_.dimension = varying;
}

/// Degree 0. @return the l1 change of the mean, in the units of the partition
double PatchReduction::keep_nearest_to_mean(double weight) {
  const std::size_t d = points_.dimension, n = points_.count;
  const auto z = [&](std::size_t i, std::size_t j) -> double& { return points_.z[i * points_.stride + j]; };
  for (std::size_t i = 0; i < d; ++i) {
    double mean = 0;
    for (std::size_t j = 0; j < n; ++j) mean += points_.weight[j] * z(i, j);
    for (std::size_t j = 0; j < n; ++j) z(i, j) -= mean / weight;
  }
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < n; ++j) {
    double square = 0;
    for (std::size_t i = 0; i < d; ++i) square += z(i, j) * z(i, j);
    if (square < least) least = square, nearest = j;
  }
  double change = 0;
  for (std::size_t i = 0; i < d; ++i) change += half_[i] * std::abs(z(i, nearest));
  points_.label[0] = points_.label[nearest];
  points_.weight[0] = weight;
  points_.count = 1;
  return change;
}

const PolynomialBasis& PatchReduction::basis(std::size_t dimension, int degree) {
  if (degree != basis_degree_) basis_.clear();
  basis_degree_ = degree;
  if (basis_.size() <= dimension) basis_.resize(dimension + 1);
  if (!basis_[dimension]) basis_[dimension] = std::make_unique<PolynomialBasis>(dimension, degree);
  return *basis_[dimension];
}

}  // namespace wienertree::recombination
