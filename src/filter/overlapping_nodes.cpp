#include "wienertree/filter/overlapping_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wienertree {
namespace {

constexpr std::size_t nodes_a_patch = 6, most_nodes = 512;
constexpr double widest = 4;    // of a patch in xi
constexpr double tail = 1e-40;  // of the mass: 13 standard deviations of a Gaussian

}  // namespace

// Points first .. last-1 become a Gauss quadrature.
void OverlappingNodes::reduce(std::size_t first, std::size_t last) {
  const std::size_t n = last - first;
  if (n <= nodes_a_patch) {
    for (std::size_t k = first; k < last; ++k) {
      x_.push_back(points_[k].x);
      log_weight_.push_back(points_[k].log_weight);
    }
    return;
  }
  double largest = -std::numeric_limits<double>::infinity(), sum = 0;
  for (std::size_t k = first; k < last; ++k) largest = std::max(largest, points_[k].log_weight);
  const double centre = (points_[first].x + points_[last - 1].x) / 2,
               half = (points_[last - 1].x - points_[first].x) / 2;
  z_.resize(n);
  w_.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    z_[k] = half > 0 ? std::clamp((points_[first + k].x - centre) / half, -1.0, 1.0) : 0.0;
    sum += w_[k] = std::exp(points_[first + k].log_weight - largest);
  }
  const std::size_t found = gauss_.compute(z_, w_, nodes_a_patch);
  for (std::size_t k = 0; k < found; ++k) {
    if (!(gauss_.weights()[k] > 0)) continue;
    x_.push_back(centre + half * gauss_.nodes()[k]);
    log_weight_.push_back(largest + std::log(sum * gauss_.weights()[k]));
  }
}

// Ends of patches of points first .. last-1.
void OverlappingNodes::cut(std::size_t first, std::size_t last, double width) {
  while (first < last) {
    std::size_t end = first + 1;
    while (end < last && xi_[end] - xi_[first] <= width) ++end;
    end_.push_back(end);
    first = end;
  }
}

// Points sorted by place, the weight of each relative to the whole, and xi.
void OverlappingNodes::sort(const Generation& from, std::span<const double> spread) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  points_.clear();
  double most = 0, largest = -infinity, sum = 0;
  for (const double s : spread) most = s > most && s < infinity ? s : most;
  if (!(most > 0)) most = 1;  // without noise only the number of nodes counts
  for (std::size_t n = 0; n < from.size(); ++n) {
    if (!(from.log_weight[n] > -infinity)) continue;
    points_.push_back(
        {from.states(0, n), from.log_weight[n], spread[n] >= 1e-3 * most ? spread[n] : 1e-3 * most});
    largest = std::max(largest, from.log_weight[n]);
  }
  std::sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) {
    return a.x < b.x || (a.x == b.x && a.log_weight < b.log_weight);
  });
  weight_.resize(points_.size());
  xi_.assign(points_.size(), 0.0);
  for (std::size_t k = 0; k < points_.size(); ++k)
    sum += weight_[k] = std::exp(points_[k].log_weight - largest);
  for (double& w : weight_) w /= sum;
  for (std::size_t k = 1; k < points_.size(); ++k)
    xi_[k] = xi_[k - 1] + 2 * (points_[k].x - points_[k - 1].x) / (points_[k].spread + points_[k - 1].spread);
}

void OverlappingNodes::thin(const Generation& from, std::span<const double> spread, std::size_t nodes,
                            Generation& out) {
  sort(from, spread);
  const std::size_t N = points_.size();
  std::size_t first = 0, last = N;
  for (double mass = 0; first < N && (mass += weight_[first]) < tail; ++first) continue;
  for (double mass = 0; last > first && (mass += weight_[last - 1]) < tail; --last) continue;
  const double fewest = static_cast<double>(std::max<std::size_t>(1, nodes / nodes_a_patch));
  const double most = std::max(fewest, static_cast<double>(most_nodes / nodes_a_patch));
  double width = widest;
  for (int k = 0; k < 8; ++k) {
    end_.clear();
    if (first > 0) end_.push_back(first);
    cut(first, last, width);
    if (last < N) end_.push_back(N);
    const auto patches = static_cast<double>(end_.size());
    if (patches > most)
      width *= 1.2 * patches / most;
    else if (patches < fewest && N > nodes)
      width *= 0.9 * patches / fewest;
    else
      break;
  }
  x_.clear();
  log_weight_.clear();
  for (std::size_t k = 0; k < end_.size(); ++k) reduce(k == 0 ? 0 : end_[k - 1], end_[k]);
  out.time = from.time;
  out.states.reshape(from.states.components(), x_.size());
  std::copy(x_.begin(), x_.end(), out.states.component(0).begin());
  for (std::size_t i = 1; i < out.states.components(); ++i)
    std::fill(out.states.component(i).begin(), out.states.component(i).end(), from.states(i, 0));
  out.log_weight.assign(log_weight_.begin(), log_weight_.end());
  out.log_likelihood.clear();
  out.parent.clear();
  out.branch.clear();
  out.count.clear();
}

}  // namespace wienertree
