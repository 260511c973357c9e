#pragma once
/// The random thinnings that count particles: one code path, in which a method is only the law of the counts.
#include <span>
#include <string_view>

#include "wienertree/thinning/masses.hpp"
#include "wienertree/thinning/site_order.hpp"
#include "wienertree/thinning/thinning.hpp"

namespace wienertree {

/// Order of the sites -> masses -> counts -> selection: a site with o > 0 particles is kept with log-weight
/// log(total mass) + log(o / N), sites in the order visited.
class CountingThinning final : public Thinning {
 public:
  /// @pre `method` is tbba, multinomial, residual, stratified or systematic
  CountingThinning(ThinningMethod method, SiteOrder order);
  /// Draws numbers 0 .. max(M, N) of `random` at most. Allocates nothing once buffers have grown.
  /// @throws RunError also if in spatial order a site of positive weight has a state that is not finite
  /// @throws InputError if N is 0 or above 2^32 - 1, or the shapes of `sites` do not fit
  void thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) override;
  std::string_view name() const override;

 private:
  void count_particles(std::span<const std::uint64_t> mass, const RandomStream& random, ThreadPool* threads);
  template <class SiteAt>
  void collect(SiteAt site_at, ThreadPool* threads, Selection& out);

  ThinningMethod method_;
  SiteOrder order_;
  SiteOrdering ordering_;
  ParticleMasses masses_;
  Buffer<std::uint32_t> visit_;
  Buffer<std::uint32_t> count_;
  std::vector<std::size_t> kept_before_;  ///< each block of sites
  std::vector<double> log_small_;         ///< log o for small o > 0
};

/// Keeps every site of positive weight, with its weight, in the order asked for; the budget is not used.
class KeepAll final : public Thinning {
 public:
  explicit KeepAll(SiteOrder order) : order_(order) {}
  void thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) override;
  std::string_view name() const override { return "none"; }
  bool deterministic() const override { return true; }

 private:
  SiteOrder order_;
  SiteOrdering ordering_;
  ParticleMasses masses_;
  Buffer<std::uint32_t> visit_;
};

}  // namespace wienertree
