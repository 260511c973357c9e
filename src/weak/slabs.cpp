#include "wienertree/weak/slabs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace wienertree {

std::size_t Slabs::number(std::size_t dimension, std::size_t budget) {
  return dimension == 2 ? std::clamp<std::size_t>(budget / 120, 1, 8)
                        : std::clamp<std::size_t>(budget / 60, 1, 24);
}

void Slabs::thin(const Generation& sites, const std::vector<double>& value, std::size_t budget,
                 const RandomStream& random, Thinning& thinning, Selection& out, ConstBatchView deviation) {
  const std::size_t total = sites.size(), d = sites.states.components();
  order_.resize(total);
  std::iota(order_.begin(), order_.end(), 0U);
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return value[a] != value[b] ? value[a] < value[b] : a < b;
  });
  double mass = 0, below = 0;
  for (const double w : sites.log_weight) mass += std::exp(w);
  const std::size_t slabs = number(d, budget);
  out.site.clear();
  out.log_weight.clear();
  out.count.clear();
  out.moved_states.reshape(0, 0);
  out.discarded = 0;
  std::size_t first = 0;
  for (std::size_t k = 1; k <= slabs; ++k) {
    const double share = mass * static_cast<double>(k) / static_cast<double>(slabs);
    std::size_t last = first;
    while (last < total && (k == slabs || below < share)) below += std::exp(sites.log_weight[order_[last++]]);
    if (last == first) continue;
    states_.reshape(d, last - first);
    weight_.resize(last - first);
    for (std::size_t n = first; n < last; ++n) {
      weight_[n - first] = sites.log_weight[order_[n]];
      for (std::size_t i = 0; i < d; ++i) states_(i, n - first) = sites.states(i, order_[n]);
    }
    Sites part{states_, weight_};
    if (deviation.nodes() == total) {
      deviation_.reshape(d, last - first);
      for (std::size_t n = first; n < last; ++n)
        for (std::size_t i = 0; i < d; ++i) deviation_(i, n - first) = deviation(i, order_[n]);
      part.deviation = deviation_;
    }
    thinning.thin(part, budget / slabs, random, part_);
    for (std::size_t m = 0; m < part_.site.size(); ++m) out.site.push_back(order_[first + part_.site[m]]);
    out.log_weight.insert(out.log_weight.end(), part_.log_weight.begin(), part_.log_weight.end());
    out.discarded += part_.discarded;
    first = last;
  }
}

}  // namespace wienertree
