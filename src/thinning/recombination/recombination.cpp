#include "wienertree/thinning/recombination/recombination.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/prefix_sort.hpp"
#include "wienertree/thinning/recombination/line.hpp"
#include "wienertree/thinning/recombination/space.hpp"

namespace wienertree {
namespace {

class Recombination final : public Thinning {
 public:
  Recombination(int degree, bool patched) : degree_(degree), patched_(patched) {}
  void thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) override;
  std::string_view name() const override { return patched_ ? "recombination" : "levelwise"; }
  bool deterministic() const override { return true; }

 private:
  void find_live_sites(const Sites& sites);
  void find_varying_components(const Sites& sites);
  void sort_sites(const Sites& sites);
  void keep_all(const Sites& sites, Selection& out) const;
  void keep_first(const Sites& sites, Selection& out) const;
  void thin_line(const Sites& sites, std::size_t budget, Selection& out);
  void thin_space(const Sites& sites, std::size_t budget, Selection& out);
  void scale_locally(const Sites& sites);

  int degree_;
  bool patched_;
  std::vector<std::uint32_t> live_;   ///< sites of positive weight, in lexicographic order
  std::vector<std::size_t> varying_;  ///< components
  std::vector<double> log_weight_;    ///< of the live sites
  std::vector<double> deviation_;     ///< of the live sites, where one component varies
  Batch x_;                           ///< varying components of the live sites
  Batch scaled_;                      ///< the same on the scale of local deviations
  std::vector<std::uint32_t> order_;
  Buffer<std::uint64_t> items_, scratch_;
  recombination::LineRecombination line_;
  recombination::LineNodes nodes_;
  recombination::SpaceRecombination space_;
  recombination::KeptPoints kept_;
};

void Recombination::thin(const Sites& sites, std::size_t budget, const RandomStream&, Selection& out) {
  if (budget < 1) throw InputError("the number of nodes must be at least 1", "recombination", "0");
  find_live_sites(sites);
  find_varying_components(sites);
  out.count.clear();
  out.discarded = 0;
  out.moved_states.reshape(0, 0);
  // Patches of a given width may be fewer than the budget allows.
  const bool by_width = patched_ && sites.width > 0 && varying_.size() == 1;
  if (live_.size() <= budget && !by_width) return keep_all(sites, out);
  sort_sites(sites);
  if (varying_.empty()) return keep_first(sites, out);
  log_weight_.resize(live_.size());
  x_.reshape(varying_.size(), live_.size());
  for (std::size_t j = 0; j < live_.size(); ++j) log_weight_[j] = sites.log_weight[live_[j]];
  for (std::size_t i = 0; i < varying_.size(); ++i) {
    const auto from = sites.x.component(varying_[i]);
    const auto to = x_.component(i);
    for (std::size_t j = 0; j < live_.size(); ++j) to[j] = from[live_[j]];
  }
  if (varying_.size() == 1)
    thin_line(sites, budget, out);
  else
    thin_space(sites, budget, out);
}

void Recombination::find_live_sites(const Sites& sites) {
  const std::size_t n = sites.log_weight.size();
  if (sites.x.nodes() != n)
    throw InputError(fmt::format("{} states but {} log-weights", sites.x.nodes(), n), "recombination");
  if (n > std::numeric_limits<std::uint32_t>::max())
    throw InputError("too many sites for 32-bit indices", "recombination", fmt::format("{}", n));
  live_.clear();
  for (std::size_t m = 0; m < n; ++m) {
    const double l = sites.log_weight[m];
    if (!(l <= std::numeric_limits<double>::max()))
      throw RunError(fmt::format("the log-weight of site {} of {} is not a number below infinity", m, n),
                     "recombination", fmt::format("{}", l));
    if (l > -std::numeric_limits<double>::infinity()) live_.push_back(static_cast<std::uint32_t>(m));
  }
  if (live_.empty())
    throw RunError("no site has a positive weight", "recombination", fmt::format("{} sites", n));
}

void Recombination::find_varying_components(const Sites& sites) {
  varying_.clear();
  for (std::size_t i = 0; i < sites.x.components(); ++i) {
    const auto x = sites.x.component(i);
    bool varies = false;
    for (const std::uint32_t m : live_) {
      if (!std::isfinite(x[m]))
        throw RunError(fmt::format("component {} of the state of site {} is not finite", i, m),
                       "recombination", fmt::format("{}", x[m]));
      varies |= x[m] != x[live_.front()];
    }
    if (varies) varying_.push_back(i);
  }
}

/// By the components that vary, first to last, then by log-weight, so that only equal sites are told apart by
/// where they are stored.
void Recombination::sort_sites(const Sites& sites) {
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    for (const std::size_t i : varying_) {
      const double x = sites.x(i, a), y = sites.x(i, b);
      if (x != y) return x < y;
    }
    if (sites.log_weight[a] != sites.log_weight[b]) return sites.log_weight[a] < sites.log_weight[b];
    return a < b;
  };
  // The order of the prefix, a float's bits made monotone, agrees with that of the first component.
  const auto prefix = [&](std::uint32_t m) {
    if (varying_.empty()) return 0u;
    const auto bits = std::bit_cast<std::uint64_t>(sites.x(varying_.front(), m) + 0.0);  // -0 becomes 0
    const std::uint64_t mask = bits >> 63 ? ~std::uint64_t{0} : std::uint64_t{1} << 63;
    return static_cast<std::uint32_t>((bits ^ mask) >> 32);
  };
  constexpr ItemLayout layout;
  items_.resize(live_.size());
  for (std::size_t j = 0; j < live_.size(); ++j) items_[j] = layout.item(prefix(live_[j]), live_[j]);
  sort_items(items_, scratch_, layout);
  settle_equal_prefixes(items_, layout, before);
  for (std::size_t j = 0; j < live_.size(); ++j) live_[j] = layout.index(items_[j]);
}

void Recombination::keep_all(const Sites& sites, Selection& out) const {
  out.site.assign(live_.begin(), live_.end());
  out.log_weight.resize(live_.size());
  for (std::size_t j = 0; j < live_.size(); ++j) out.log_weight[j] = sites.log_weight[live_[j]];
}

/// All sites lie at one point.
void Recombination::keep_first(const Sites& sites, Selection& out) const {
  double largest = sites.log_weight[live_.front()], sum = 0;
  for (const std::uint32_t m : live_) largest = std::max(largest, sites.log_weight[m]);
  for (const std::uint32_t m : live_) sum += std::exp(sites.log_weight[m] - largest);
  out.site.assign(1, live_.front());
  out.log_weight.assign(1, largest + std::log(sum));
}

void Recombination::thin_line(const Sites& sites, std::size_t budget, Selection& out) {
  // (2s - 1)/2 + 1 = s nodes a patch: one patch if s is the budget.
  constexpr std::size_t most = std::numeric_limits<int>::max() / 2;
  const int degree = !patched_ && degree_ == 0 ? static_cast<int>(2 * std::min(budget, most) - 1) : degree_;
  const std::size_t in_a_patch = static_cast<std::size_t>(degree) / 2 + 1;
  bool evenly = patched_ && sites.deviation.nodes() == sites.x.nodes();
  if (evenly) {
    deviation_.resize(live_.size());
    double largest = 0;
    for (std::size_t j = 0; j < live_.size(); ++j)
      largest = std::max(largest, deviation_[j] = sites.deviation(varying_.front(), live_[j]));
    evenly = largest > 0 && std::isfinite(largest);
  }
  if (evenly)
    line_.reduce_evenly(x_.component(0), log_weight_, deviation_, sites.width, degree, budget, nodes_);
  else
    line_.reduce(x_.component(0), log_weight_, degree, patched_ ? budget : std::min(budget, in_a_patch),
                 nodes_);
  const std::size_t kept = nodes_.x.size();
  out.site.resize(kept);
  out.moved_states.reshape(sites.x.components(), kept);
  for (std::size_t i = 0; i < sites.x.components(); ++i)
    std::fill_n(out.moved_states.component(i).begin(), kept, sites.x(i, live_.front()));
  std::copy(nodes_.x.begin(), nodes_.x.end(), out.moved_states.component(varying_.front()).begin());
  for (std::size_t j = 0; j < kept; ++j) out.site[j] = live_[nodes_.near[j]];
  out.log_weight.assign(nodes_.log_weight.begin(), nodes_.log_weight.end());
  out.discarded = nodes_.discarded;
}

void Recombination::thin_space(const Sites& sites, std::size_t budget, Selection& out) {
  const std::size_t d = varying_.size();
  // (d + r choose r) > r: a degree beyond the budget is lowered anyhow.
  const auto largest_useful =
      static_cast<int>(std::min<std::size_t>(budget, std::numeric_limits<int>::max()));
  int degree = degree_ > 0 ? std::min(degree_, largest_useful) : 0;
  if (degree == 0 && patched_) degree = recombination_degree(d, budget);
  if (degree == 0 && !patched_) degree = largest_useful;
  while (moment_number(d, degree, budget + 1) > budget) --degree;
  if (!patched_) budget = moment_number(d, degree, budget);
  const bool scaled = patched_ && sites.deviation.nodes() == sites.x.nodes();
  if (scaled) scale_locally(sites);
  space_.reduce(x_, scaled ? ConstBatchView(scaled_) : ConstBatchView(x_), log_weight_, degree, budget,
                sites.threads, kept_);
  out.site.resize(kept_.point.size());
  for (std::size_t j = 0; j < kept_.point.size(); ++j) out.site[j] = live_[kept_.point[j]];
  out.log_weight.assign(kept_.log_weight.begin(), kept_.log_weight.end());
  out.discarded = kept_.discarded;
}

// scaled_ = integral of dx_i / deviation_i(x_i) for each component, the deviation being that of sites with about
// the same x_i, on average: 64 blocks of sites, in the order of x_i. A component without noise stays as it is.
void Recombination::scale_locally(const Sites& sites) {
  const std::size_t n = live_.size();
  constexpr std::size_t blocks = 64;
  scaled_.reshape(varying_.size(), n);
  order_.resize(n);
  double heaviest = log_weight_.front();
  for (const double l : log_weight_) heaviest = std::max(heaviest, l);
  for (std::size_t i = 0; i < varying_.size(); ++i) {
    const auto x = x_.component(i);
    const auto y = scaled_.component(i);
    std::iota(order_.begin(), order_.end(), 0U);
    std::sort(order_.begin(), order_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return x[a] != x[b] ? x[a] < x[b] : a < b; });
    std::array<double, blocks> mean{};
    double sum = 0, mass = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
      double in_block = 0, weight = 0;
      for (std::size_t j = b * n / blocks; j < (b + 1) * n / blocks; ++j) {
        const double w = std::exp(log_weight_[order_[j]] - heaviest) + 1e-300;
        in_block += w * sites.deviation(varying_[i], live_[order_[j]]);
        weight += w;
      }
      if (weight > 0) mean[b] = in_block / weight;
      sum += in_block, mass += weight;
    }
    const double floor = 1e-3 * sum / mass;
    if (!(floor > 0) || !std::isfinite(floor)) {
      std::copy(x.begin(), x.end(), y.begin());
      continue;
    }
    y[order_[0]] = 0;
    for (std::size_t b = 0; b < blocks; ++b)
      for (std::size_t j = std::max<std::size_t>(1, b * n / blocks); j < (b + 1) * n / blocks; ++j)
        y[order_[j]] = y[order_[j - 1]] + (x[order_[j]] - x[order_[j - 1]]) / std::max(mean[b], floor);
  }
}

void check_degree(int degree) {
  if (degree < 0)
    throw InputError("the degree of recombination must be positive, or 0 to be chosen", "recombination",
                     fmt::format("{}", degree));
}

}  // namespace

std::unique_ptr<Thinning> make_recombination(int degree) {
  check_degree(degree);
  return std::make_unique<Recombination>(degree, true);
}

std::unique_ptr<Thinning> make_levelwise_recombination(int degree) {
  check_degree(degree);
  return std::make_unique<Recombination>(degree, false);
}

double levelwise_bytes(std::size_t dimension, std::size_t nodes) {
  const auto N = static_cast<double>(nodes);
  // Moments, their copy that is factorised, and its reflectors, 2N x N each; null vectors 2N x 2N.
  return dimension > 1 ? 10 * sizeof(double) * N * N : 0;
}

std::size_t moment_number(std::size_t dimension, int degree, std::size_t cap) {
  // C(d+i, i) = C(d+i-1, i-1) (d+i) / i is exact at each i; growing with i, it may stop at the cap.
  std::uint64_t number = 1;
  for (int i = 1; i <= degree && number < cap; ++i) {
    const auto k = static_cast<std::uint64_t>(i);
    number = number * (dimension + k) / k;
  }
  return std::min<std::size_t>(number, cap);
}

int recombination_degree(std::size_t dimension, std::size_t budget) {
  int degree = dimension <= 2 ? 5 : dimension <= 4 ? 3 : 2;
  const auto patches = [&](int r) { return budget / moment_number(dimension, r, budget + 1); };
  while (degree > 1 && patches(degree) < 2 * static_cast<std::size_t>(degree)) --degree;
  return degree == 1 && patches(1) == 0 ? 0 : degree;
}

}  // namespace wienertree
