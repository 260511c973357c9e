#include "wienertree/thinning/counting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/resampling.hpp"
#include "wienertree/thinning/tbba.hpp"

namespace wienertree {
namespace {

constexpr std::size_t block = 16384;  ///< sites a task

void check_shapes(const Sites& sites) {
  if (sites.x.nodes() != sites.log_weight.size())
    throw InputError(fmt::format("{} states but {} log-weights", sites.x.nodes(), sites.log_weight.size()),
                     "thinning");
}

void put_in_order(SiteOrder order, SiteOrdering& ordering, const Sites& sites, const ParticleMasses& masses,
                  Buffer<std::uint32_t>& visit) {
  if (order == SiteOrder::spatial)
    ordering.spatial(sites, masses, visit);
  else
    ordering.tree(sites, visit);
}

}  // namespace

CountingThinning::CountingThinning(ThinningMethod method, SiteOrder order)
    : method_(method), order_(order), log_small_(256) {
  for (std::size_t o = 1; o < log_small_.size(); ++o) log_small_[o] = std::log(static_cast<double>(o));
}

std::string_view CountingThinning::name() const {
  switch (method_) {
    case ThinningMethod::multinomial:
      return "multinomial";
    case ThinningMethod::residual:
      return "residual";
    case ThinningMethod::stratified:
      return "stratified";
    case ThinningMethod::systematic:
      return "systematic";
    default:
      return "tbba";
  }
}

void CountingThinning::thin(const Sites& sites, std::size_t budget, const RandomStream& random,
                            Selection& out) {
  check_shapes(sites);
  assign_masses(sites.log_weight, budget, masses_, sites.threads);
  if (order_ == SiteOrder::tree && sites.parents == 0) {
    // Visited as they are stored; a site without weight has no mass.
    count_particles(masses_.mass, random, sites.threads);
    collect([](std::size_t i) { return i; }, sites.threads, out);
    return;
  }
  put_in_order(order_, ordering_, sites, masses_, visit_);
  Buffer<std::uint64_t>& visited_mass = ordering_.workspace();
  resize_unspecified(visited_mass, visit_.size());
  for_blocks(sites.threads, visit_.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
    for (std::size_t i = first; i < first + count; ++i) visited_mass[i] = masses_.mass[visit_[i]];
  });
  count_particles(visited_mass, random, sites.threads);
  collect([this](std::size_t i) { return visit_[i]; }, sites.threads, out);
}

void CountingThinning::count_particles(std::span<const std::uint64_t> mass, const RandomStream& random,
                                       ThreadPool* threads) {
  resize_unspecified(count_, mass.size());
  const int bits = masses_.fraction_bits;
  switch (method_) {
    case ThinningMethod::multinomial:
      return multinomial_counts(mass, bits, random, count_);
    case ThinningMethod::residual:
      return residual_counts(mass, bits, random, count_);
    case ThinningMethod::stratified:
      return stratified_counts(mass, bits, random, count_);
    case ThinningMethod::systematic:
      return systematic_counts(mass, bits, random, count_);
    default:
      break;
  }
  if (threads != nullptr && threads->size() > 1) return tbba(mass, bits, random, *threads, count_);
  TbbaRemainder all{masses_.particles << bits, false};
  tbba(mass, bits, random, 0, all, count_);
}

// Blocks are counted, then written each to its own place.
template <class SiteAt>
void CountingThinning::collect(SiteAt site_at, ThreadPool* threads, Selection& out) {
  const std::size_t n = count_.size();
  kept_before_.resize((n + block - 1) / block);
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t b) {
    std::size_t kept = 0;
    for (std::size_t i = first; i < first + count; ++i) kept += count_[i] > 0 ? 1 : 0;
    kept_before_[b] = kept;
  });
  std::size_t kept = 0;
  for (std::size_t& k : kept_before_) kept += std::exchange(k, kept);
  resize_unspecified(out.site, kept);
  resize_unspecified(out.count, kept);
  resize_unspecified(out.log_weight, kept);
  const double log_particle = masses_.log_total - std::log(static_cast<double>(masses_.particles));
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t b) {
    std::size_t k = kept_before_[b];
    const std::size_t end = b + 1 < kept_before_.size() ? kept_before_[b + 1] : kept;
    for (std::size_t i = first; i < first + count && k < end; ++i) {
      out.site[k] = static_cast<std::uint32_t>(site_at(i));
      out.count[k] = count_[i];
      k += count_[i] > 0 ? 1 : 0;
    }
    for (k = kept_before_[b]; k < end; ++k) {
      const std::uint32_t o = out.count[k];
      out.log_weight[k] =
          log_particle + (o < log_small_.size() ? log_small_[o] : std::log(static_cast<double>(o)));
    }
  });
  out.discarded = 0;
  out.moved_states.reshape(0, 0);
}

void KeepAll::thin(const Sites& sites, std::size_t, const RandomStream&, Selection& out) {
  check_shapes(sites);
  assign_masses(sites.log_weight, 1, masses_, sites.threads);
  put_in_order(order_, ordering_, sites, masses_, visit_);
  out.site.assign(visit_.begin(), visit_.end());
  out.count.clear();
  out.log_weight.resize(out.site.size());
  for (std::size_t k = 0; k < out.site.size(); ++k) out.log_weight[k] = sites.log_weight[out.site[k]];
  out.discarded = 0;
  out.moved_states.reshape(0, 0);
}

}  // namespace wienertree
