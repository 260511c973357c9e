#include "wienertree/filter/overlapping_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wienertree {
namespace {

constexpr std::size_t nodes_a_patch = 6, most_nodes = 512;
constexpr double widest = 6;  // of a patch in xi

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

void OverlappingNodes::thin(const Generation& from, std::span<const double> spread, std::size_t nodes,
                            Generation& out) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  points_.clear();
  double most = 0;
  for (const double s : spread) most = s > most && s < infinity ? s : most;
  for (std::size_t n = 0; n < from.size(); ++n)
    if (from.log_weight[n] > -infinity)
      points_.push_back(
          {from.states(0, n), from.log_weight[n], spread[n] >= 1e-3 * most ? spread[n] : 1e-3 * most});
  std::sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) {
    return a.x < b.x || (a.x == b.x && a.log_weight < b.log_weight);
  });
  xi_.assign(points_.size(), 0.0);
  for (std::size_t k = 1; k < points_.size(); ++k)
    xi_[k] = xi_[k - 1] + 2 * (points_[k].x - points_[k - 1].x) / (points_[k].spread + points_[k - 1].spread);
  // Without any noise only the number of nodes counts.
  const double range = most > 0 ? xi_.back() : 0;
  const auto fewest = static_cast<double>(std::max<std::size_t>(1, nodes / nodes_a_patch));
  const auto patches = std::clamp(std::ceil(range / widest), fewest,
                                  std::max(fewest, static_cast<double>(most_nodes / nodes_a_patch)));
  if (!(most > 0))
    for (std::size_t k = 0; k < xi_.size(); ++k) xi_[k] = points_[k].x - points_[0].x;
  const double width = xi_.back() / patches;
  x_.clear();
  log_weight_.clear();
  for (std::size_t first = 0, last = 0; first < points_.size(); first = last) {
    const double patch = width > 0 ? std::min(std::floor(xi_[first] / width), patches - 1) : 0;
    for (last = first + 1; last < points_.size(); ++last)
      if (width > 0 && std::min(std::floor(xi_[last] / width), patches - 1) != patch) break;
    reduce(first, last);
  }
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
