#include "wienertree/thinning/site_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr std::size_t least_sample = 64, largest_sample = 1024;
constexpr std::size_t block = 16384;  ///< sites a task; a multiple of hilbert_block
static_assert(block % hilbert_block == 0);

// Every site of finite log-weight among the `count` that `next` names, written to `out`, without branching.
// Returns their number; the place behind the last is scratch.
template <class Next>
std::size_t write_live(std::span<const double> log_weight, std::size_t count, Next next, std::uint32_t* out) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t site = next();
    out[kept] = static_cast<std::uint32_t>(site);
    kept += log_weight[site] > -std::numeric_limits<double>::infinity() ? 1 : 0;
  }
  return kept;
}

// walk_from(i) names the i-th site and those after it, call by call. Blocks are written side by side, each to
// the places of its sites, and moved together if one has a dead site.
template <class WalkFrom>
void live_sites(std::span<const double> log_weight, WalkFrom walk_from, ThreadPool* threads,
                Buffer<std::uint32_t>& out, std::vector<std::size_t>& live) {
  const std::size_t n = log_weight.size();
  resize_unspecified(out, n);
  live.resize((n + block - 1) / block);
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t b) {
    live[b] = write_live(log_weight, count, walk_from(first), out.data() + first);
  });
  std::size_t kept = 0;
  for (std::size_t b = 0; b < live.size(); ++b) {
    if (kept != b * block) std::copy_n(out.data() + b * block, live[b], out.data() + kept);
    kept += live[b];
  }
  out.resize(kept);
}

inline std::uint64_t cell(double x, double low, double scale, double cells) {
  const double position = (0.25 * x - low) * (scale * cells);
  // In this order what is not a number, as 0 times infinity where all sites lie within 1e-305, is cell 0.
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::min(std::max(0.0, position), cells - 1)));
}

constexpr auto as_stored = [](std::size_t first) { return [i = first]() mutable { return i++; }; };

}  // namespace

void SiteOrdering::tree(const Sites& sites, Buffer<std::uint32_t>& visit) {
  const std::size_t n = sites.log_weight.size(), parents = sites.parents;
  if (parents == 0) return live_sites(sites.log_weight, as_stored, sites.threads, visit, live_);
  if (n % parents != 0)
    throw InputError(fmt::format("{} sites are not a whole number of branches of {} parents", n, parents),
                     "tree order");
  const std::size_t branches = n / parents;
  const auto by_parent = [=](std::size_t first) {
    return [=, parent = first / branches, branch = first % branches]() mutable {
      const std::size_t site = branch * parents + parent;
      const bool wrap = ++branch == branches;
      branch = wrap ? 0 : branch;
      parent += wrap ? 1 : 0;
      return site;
    };
  };
  live_sites(sites.log_weight, by_parent, sites.threads, visit, live_);
}

void SiteOrdering::spatial(const Sites& sites, const ParticleMasses& masses, Buffer<std::uint32_t>& visit) {
  draw_sample(masses);
  if (masses.all_positive) {
    resize_unspecified(visit, sites.log_weight.size());
    sort_in_space(
        sites, visit.size(), [](std::size_t i) { return static_cast<std::uint32_t>(i); }, visit);
  } else {
    live_sites(sites.log_weight, as_stored, sites.threads, visit, live_);
    sort_in_space(
        sites, visit.size(), [live = visit.data()](std::size_t i) { return live[i]; }, visit);
  }
}

template <class Site>
void SiteOrdering::sort_in_space(const Sites& sites, std::size_t live, Site site,
                                 Buffer<std::uint32_t>& visit) {
  axes_.clear();
  Axis axis;
  for (std::size_t c = 0; c < sites.x.components(); ++c)
    if (make_axis(sites, live, site, c, axis)) axes_.push_back(axis);
  if (axes_.size() > largest_hilbert_dimension)
    throw InputError(fmt::format("spatial order takes at most {} varying components; use tree order",
                                 largest_hilbert_dimension),
                     "spatial order", fmt::format("{}", axes_.size()));
  const auto write = [&](auto site_at) {
    for_blocks(sites.threads, live, block, [&](std::size_t first, std::size_t count, std::size_t) {
      for (std::size_t i = first; i < first + count; ++i) visit[i] = site_at(i);
    });
  };
  if (axes_.empty()) return write(site);
  resize_unspecified(items_, live);
  const ItemLayout layout =
      axes_.size() == 1 ? line_items(sites, live, site) : curve_items(sites, live, site);
  write([&](std::size_t i) { return layout.index(items_[i]); });
}

// Sites at equal steps of mass: a sample of the weighted measure. The k-th lies where the mass below reaches
// step/2 + k step.
void SiteOrdering::draw_sample(const ParticleMasses& masses) {
  const std::size_t size = std::clamp(masses.mass.size() / 4, least_sample, largest_sample);
  const std::uint64_t step = (masses.particles << masses.fraction_bits) / size;
  sample_.clear();
  std::uint64_t behind = 0, next = step / 2;
  for (std::size_t c = 0; c < masses.chunk_mass.size(); ++c) {
    if (next >= behind + masses.chunk_mass[c]) {
      behind += masses.chunk_mass[c];
      continue;
    }
    const std::size_t first = c * ParticleMasses::chunk;
    const std::size_t last = std::min(first + ParticleMasses::chunk, masses.mass.size());
    for (std::size_t i = first; i < last; ++i)
      for (behind += masses.mass[i]; next < behind; next += step)
        sample_.push_back(static_cast<std::uint32_t>(i));
  }
}

// False if the component is constant over the sites.
template <class Site>
bool SiteOrdering::make_axis(const Sites& sites, std::size_t live, Site site, std::size_t component,
                             Axis& axis) {
  const std::span<const double> x = sites.x.component(component);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  range_.resize((live + block - 1) / block);
  for_blocks(sites.threads, live, block, [&](std::size_t first, std::size_t count, std::size_t b) {
    Range here;
    for (std::size_t i = first; i < first + count; ++i) {
      const double value = x[site(i)];
      here.finite &= std::abs(value) <= std::numeric_limits<double>::max();
      here.least = value < here.least ? value : here.least;
      here.most = value > here.most ? value : here.most;
    }
    range_[b] = here;
  });
  double least = infinity, most = -infinity;
  bool finite = true;
  for (const Range& r : range_) {
    finite &= r.finite;
    least = std::min(least, r.least);
    most = std::max(most, r.most);
  }
  if (!finite)
    for (std::size_t i = 0; i < live; ++i)
      if (!std::isfinite(x[site(i)]))
        throw RunError(fmt::format("component {} of the state of site {} is not finite", component, site(i)),
                       "spatial order", fmt::format("{}", x[site(i)]));
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

template <class Site>
ItemLayout SiteOrdering::line_items(const Sites& sites, std::size_t live, Site site) {
  const std::span<const double> x = sites.x.component(axes_[0].component);
  const auto axis = axes_[0];
  // The index takes the bits it needs, the cell the others: children of a tree crowd near the points of a
  // lattice, and what shares a cell is sorted by comparison.
  const ItemLayout layout{static_cast<unsigned>(std::bit_width(x.size()))};
  const double cells = std::ldexp(1.0, std::min(64 - static_cast<int>(layout.index_bits), 52));
  for_blocks(sites.threads, live, block, [&](std::size_t first, std::size_t count, std::size_t) {
    for (std::size_t i = first; i < first + count; ++i)
      items_[i] = layout.item(cell(x[site(i)], axis.low, axis.scale, cells), site(i));
  });
  sort_items(items_, scratch_, layout, sites.threads);
  settle_equal_prefixes(
      items_, layout,
      [x](std::uint32_t a, std::uint32_t b) { return x[a] < x[b] || (x[a] == x[b] && a < b); },
      sites.threads);
  return layout;
}

template <class Site>
ItemLayout SiteOrdering::curve_items(const Sites& sites, std::size_t live, Site site) {
  const std::size_t d = axes_.size();
  const unsigned bits = std::min(16U, static_cast<unsigned>(64 / d));
  const double cells = std::ldexp(1.0, static_cast<int>(bits));
  const unsigned unused = 64 - static_cast<unsigned>(d) * bits;
  constexpr ItemLayout layout;
  resize_unspecified(keys_, sites.log_weight.size());
  for_blocks(sites.threads, live, block, [&](std::size_t begin, std::size_t count, std::size_t) {
    HilbertAxes cells_of_axis;
    std::array<std::uint64_t, hilbert_block> key;
    for (std::size_t first = begin; first < begin + count; first += hilbert_block) {
      const std::size_t n = std::min(hilbert_block, begin + count - first);
      for (std::size_t i = 0; i < d; ++i) {
        const std::span<const double> x = sites.x.component(axes_[i].component);
        for (std::size_t l = 0; l < n; ++l)
          cells_of_axis[i][l] =
              static_cast<std::uint32_t>(cell(x[site(first + l)], axes_[i].low, axes_[i].scale, cells));
      }
      hilbert_keys(cells_of_axis, d, bits, key);
      for (std::size_t l = 0; l < n; ++l) {
        const std::uint64_t leading = key[l] << unused;
        keys_[site(first + l)] = leading;
        items_[first + l] = layout.item(layout.prefix(leading), site(first + l));
      }
    }
  });
  sort_items(items_, scratch_, layout, sites.threads);
  settle_equal_prefixes(
      items_, layout,
      [this](std::uint32_t a, std::uint32_t b) {
        return keys_[a] < keys_[b] || (keys_[a] == keys_[b] && a < b);
      },
      sites.threads);
  return layout;
}

}  // namespace wienertree
