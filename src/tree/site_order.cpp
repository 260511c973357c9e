#include "wienertree/tree/site_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/model/error.hpp"
#include "wienertree/tree/prefix_sort.hpp"

namespace wienertree {
namespace {

constexpr std::size_t least_sample = 64, largest_sample = 1024;
constexpr std::size_t block = 16384;  ///< sites a task; a multiple of hilbert_block
static_assert(block % hilbert_block == 0);

// Appends every site of finite log-weight that `site_at` names, without branching.
template <class SiteAt>
void live_sites(std::span<const double> log_weight, std::size_t n, SiteAt site_at,
                std::vector<std::uint32_t>& out) {
  out.resize(n);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t site = site_at(i);
    out[kept] = static_cast<std::uint32_t>(site);
    kept += log_weight[site] > -std::numeric_limits<double>::infinity() ? 1 : 0;
  }
  out.resize(kept);
}

inline std::uint32_t cell(double x, double low, double scale, double cells) {
  const double position = (0.25 * x - low) * (scale * cells);
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::min(std::max(position, 0.0), cells - 1)));
}

}  // namespace

void SiteOrdering::tree(const Sites& sites, std::vector<std::uint32_t>& visit) {
  const std::size_t n = sites.log_weight.size(), parents = sites.parents;
  if (parents == 0) {
    live_sites(
        sites.log_weight, n, [](std::size_t i) { return i; }, visit);
    return;
  }
  if (n % parents != 0)
    throw InputError(fmt::format("{} sites are not a whole number of branches of {} parents", n, parents),
                     "tree order");
  const std::size_t branches = n / parents;
  std::size_t parent = 0, branch = 0;
  const auto next = [&](std::size_t) {
    const std::size_t site = branch * parents + parent;
    const bool wrap = ++branch == branches;
    branch = wrap ? 0 : branch;
    parent += wrap ? 1 : 0;
    return site;
  };
  live_sites(sites.log_weight, n, next, visit);
}

void SiteOrdering::spatial(const Sites& sites, const ParticleMasses& masses,
                           std::vector<std::uint32_t>& visit) {
  live_sites(
      sites.log_weight, sites.log_weight.size(), [](std::size_t i) { return i; }, visit);
  draw_sample(masses);
  axes_.clear();
  Axis axis;
  for (std::size_t c = 0; c < sites.x.components(); ++c)
    if (make_axis(sites, visit, c, axis)) axes_.push_back(axis);
  if (axes_.empty()) return;
  if (axes_.size() > largest_hilbert_dimension)
    throw InputError(fmt::format("spatial order takes at most {} varying components; use tree order",
                                 largest_hilbert_dimension),
                     "spatial order", fmt::format("{}", axes_.size()));
  items_.resize(visit.size());
  if (axes_.size() == 1)
    line_items(sites, visit);
  else
    curve_items(sites, visit);
  for_blocks(sites.threads, visit.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
    for (std::size_t i = first; i < first + count; ++i) visit[i] = static_cast<std::uint32_t>(items_[i]);
  });
}

// Sites at equal steps of mass: a sample of the weighted measure.
void SiteOrdering::draw_sample(const ParticleMasses& masses) {
  const std::size_t size = std::clamp(masses.mass.size() / 4, least_sample, largest_sample);
  const std::uint64_t step = (masses.particles << masses.fraction_bits) / size;
  sample_.clear();
  sample_.reserve(size + 1);
  std::uint64_t below = 0, next = step / 2;
  for (std::size_t i = 0; i < masses.mass.size(); ++i) {
    below += masses.mass[i];
    for (; next < below; next += step) sample_.push_back(static_cast<std::uint32_t>(i));
  }
}

// False if the component is constant over the sites.
bool SiteOrdering::make_axis(const Sites& sites, std::span<const std::uint32_t> live, std::size_t component,
                             Axis& axis) {
  const std::span<const double> x = sites.x.component(component);
  double least = std::numeric_limits<double>::infinity(), most = -least;
  bool finite = true;
  for (const std::uint32_t i : live) {
    finite &= std::abs(x[i]) <= std::numeric_limits<double>::max();
    least = x[i] < least ? x[i] : least;
    most = x[i] > most ? x[i] : most;
  }
  if (!finite)
    for (const std::uint32_t i : live)
      if (!std::isfinite(x[i]))
        throw RunError(fmt::format("component {} of the state of site {} is not finite", component, i),
                       "spatial order", fmt::format("{}", x[i]));
  if (!(least < most)) return false;

  sample_values_.clear();
  for (const std::uint32_t i : sample_) sample_values_.push_back(x[i]);
  const auto quantile = [&](std::size_t rank) {
    const auto at = sample_values_.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(sample_values_.begin(), at, sample_values_.end());
    return 0.25 * *at;  // quarters: differences do not overflow
  };
  const std::size_t tail = sample_values_.size() / 64;
  double low = quantile(tail), high = quantile(sample_values_.size() - 1 - tail);
  const double width = high - low;
  if (width > 0) {
    low = std::max(0.25 * least, low - width);
    high = std::min(0.25 * most, high + width);
  } else {
    low = 0.25 * least;
    high = 0.25 * most;
  }
  // Within 2^-960 the axis has one cell; on a line the order is then settled by comparison alone.
  const double scale = high - low > 0x1.0p-960 ? 1.0 / (high - low) : 0.0;
  axis = {component, low, scale};
  return true;
}

void SiteOrdering::line_items(const Sites& sites, std::span<const std::uint32_t> live) {
  const std::span<const double> x = sites.x.component(axes_[0].component);
  const auto [component, low, scale] = axes_[0];
  for_blocks(sites.threads, live.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
    for (std::size_t i = first; i < first + count; ++i)
      items_[i] = packed_item(cell(x[live[i]], low, scale, 0x1.0p32), live[i]);
  });
  sort_items(items_, scratch_, sites.threads);
  settle_equal_prefixes(
      items_, [x](std::uint32_t a, std::uint32_t b) { return x[a] < x[b] || (x[a] == x[b] && a < b); },
      sites.threads);
}

void SiteOrdering::curve_items(const Sites& sites, std::span<const std::uint32_t> live) {
  const std::size_t d = axes_.size();
  const unsigned bits = std::min(16U, static_cast<unsigned>(64 / d));
  const double cells = std::ldexp(1.0, static_cast<int>(bits));
  const unsigned unused = 64 - static_cast<unsigned>(d) * bits;
  keys_.resize(sites.log_weight.size());
  for_blocks(sites.threads, live.size(), block, [&](std::size_t begin, std::size_t count, std::size_t) {
    HilbertAxes cells_of_axis;
    std::array<std::uint64_t, hilbert_block> key;
    for (std::size_t first = begin; first < begin + count; first += hilbert_block) {
      const std::size_t n = std::min(hilbert_block, begin + count - first);
      for (std::size_t i = 0; i < d; ++i) {
        const std::span<const double> x = sites.x.component(axes_[i].component);
        for (std::size_t l = 0; l < n; ++l)
          cells_of_axis[i][l] = cell(x[live[first + l]], axes_[i].low, axes_[i].scale, cells);
      }
      hilbert_keys(cells_of_axis, d, bits, key);
      for (std::size_t l = 0; l < n; ++l) {
        const std::uint64_t leading = key[l] << unused;
        keys_[live[first + l]] = leading;
        items_[first + l] = packed_item(static_cast<std::uint32_t>(leading >> 32), live[first + l]);
      }
    }
  });
  sort_items(items_, scratch_, sites.threads);
  settle_equal_prefixes(
      items_,
      [this](std::uint32_t a, std::uint32_t b) {
        return keys_[a] < keys_[b] || (keys_[a] == keys_[b] && a < b);
      },
      sites.threads);
}

}  // namespace wienertree
