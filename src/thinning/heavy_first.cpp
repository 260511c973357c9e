#include "wienertree/thinning/heavy_first.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/thinning/recombination/recombination.hpp"

namespace wienertree {

HeavyFirst::HeavyFirst(int degree) : recombination_(make_recombination(degree)) {}

void HeavyFirst::thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) {
  find_heavy(sites.log_weight, budget);
  log_weight_.assign(sites.log_weight.begin(), sites.log_weight.end());
  for (const std::uint32_t m : heavy_) log_weight_[m] = -std::numeric_limits<double>::infinity();
  const Sites light{sites.x, log_weight_, sites.parents, sites.threads};
  recombination_->thin(light, budget - heavy_.size(), random, out);
  if (heavy_.empty()) return;
  light_ = out;
  const std::size_t kept = light_.site.size(), d = sites.x.components();
  const bool moved = light_.moved_states.nodes() != 0;
  out.site.insert(out.site.end(), heavy_.begin(), heavy_.end());
  for (const std::uint32_t m : heavy_) out.log_weight.push_back(sites.log_weight[m]);
  if (!moved) return;
  out.moved_states.reshape(d, kept + heavy_.size());
  for (std::size_t i = 0; i < d; ++i) {
    const auto from = light_.moved_states.component(i);
    const auto to = out.moved_states.component(i);
    std::copy(from.begin(), from.end(), to.begin());
    for (std::size_t h = 0; h < heavy_.size(); ++h) to[kept + h] = sites.x(i, heavy_[h]);
  }
}

// Bad log-weights are left to the recombination, which names them.
void HeavyFirst::find_heavy(std::span<const double> log_weight, std::size_t budget) {
  heavy_.clear();
  const auto [low, high] = std::minmax_element(log_weight.begin(), log_weight.end());
  const bool good = low != log_weight.end() &&
                    std::all_of(log_weight.begin(), log_weight.end(),
                                [](double l) { return l <= std::numeric_limits<double>::max(); });
  // Where all sites fit they are all kept; else some are left to merge, since `most` is below the budget.
  const auto live =
      static_cast<std::size_t>(std::count_if(log_weight.begin(), log_weight.end(), [](double l) {
        return l > -std::numeric_limits<double>::infinity();
      }));
  if (!good || live <= budget) return;
  double mass = 0;
  for (const double l : log_weight) mass += std::exp(l - *high);
  const double threshold = *high + std::log(mass / static_cast<double>(budget));
  for (std::size_t m = 0; m < log_weight.size(); ++m)
    if (log_weight[m] > threshold) heavy_.push_back(static_cast<std::uint32_t>(m));
  const std::size_t most = budget / 2;
  if (heavy_.size() <= most) return;
  const auto last = heavy_.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(heavy_.begin(), last, heavy_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return log_weight[a] != log_weight[b] ? log_weight[a] > log_weight[b] : a < b;
  });
  heavy_.erase(last, heavy_.end());
  std::sort(heavy_.begin(), heavy_.end());
}

}  // namespace wienertree
