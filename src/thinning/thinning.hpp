#pragma once
/// Seam 3: a weighted measure in, a smaller weighted measure on some of the same nodes out.
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "wienertree/numeric/batch.hpp"
#include "wienertree/numeric/parallel.hpp"
#include "wienertree/numeric/random.hpp"

namespace wienertree {

enum class ThinningMethod {
  none,
  tbba,
  multinomial,
  residual,
  stratified,
  systematic,
  recombination,  ///< of patches
  levelwise,      ///< recombination of the whole generation as one patch
  heavy_first,    ///< heavy sites stay as they are, the others are recombined
};

/// Whether a method is deterministic and merges sites instead of counting particles.
constexpr bool recombines(ThinningMethod method) {
  return method == ThinningMethod::recombination || method == ThinningMethod::levelwise ||
         method == ThinningMethod::heavy_first;
}

/// Order in which the random methods visit the sites: as they lie in the tree, or sorted in space (by x for
/// d = 1, along a Hilbert curve for d > 1). Spatial order turns an error of N^{-1/2} into about N^{-1} in
/// d = 1.
enum class SiteOrder { tree, spatial };

/// The sites kept, with log-weights of the same total mass as the input. Buffers are reused from call to
/// call.
struct Selection {
  std::vector<std::uint32_t> site;   ///< ascending in the order the method visited them; no site twice
  std::vector<double> log_weight;    ///< one per kept site
  std::vector<std::uint32_t> count;  ///< particles per kept site for the methods that count; empty otherwise
  /// Deterministic methods: an estimate of the error of this thinning. Lower moments being kept, the integral
  /// of a smooth f changes at first order by sum_a d^a f / a! times the change of the moments of the first
  /// degree that is not kept; this is the sum over patches of the |changes| / a!, in standard deviations of
  /// the whole measure and relative to its mass: the change for an f whose derivatives of that degree are 1
  /// per standard deviation. 0 for random methods.
  double discarded = 0;
  /// d x (kept sites), column n the state of the n-th kept site, when the method places nodes anew (Gauss
  /// reduction, d = 1); 0 nodes when the sites keep their own states. `site` then names a site next to the
  /// new node, each at most once: parent and branch come from it, the state from here.
  Batch moved_states;
};

/// The sites: states x (d x M), and log-weights (M). A site of log-weight -infinity is never kept. In tree
/// order, site index m = branch * parents + parent (children of one branch are contiguous), and is visited
/// parent by parent.
struct Sites {
  ConstBatchView x;
  std::span<const double> log_weight;
  std::size_t parents = 0;        ///< 0: visit in storage order
  ThreadPool* threads = nullptr;  ///< to work on, if any; results do not depend on it
  /// d x M or empty: the scale of each component at each site, its standard deviation over the next step, say.
  /// Recombination then measures distances in it.
  ConstBatchView deviation = {};
  double width = 0;  ///< of patches, in these; 0: by the budget alone
};

class Thinning {
 public:
  virtual ~Thinning() = default;
  /// @param budget N >= 1: number of particles, or of nodes kept at most for deterministic methods
  /// @throws RunError if no weight is positive, or one is NaN or +infinity
  virtual void thin(const Sites& sites, std::size_t budget, const RandomStream& random, Selection& out) = 0;
  virtual std::string_view name() const = 0;
  virtual bool deterministic() const { return false; }
};

struct ThinningOptions {
  ThinningMethod method = ThinningMethod::tbba;
  SiteOrder order = SiteOrder::spatial;
  int recombination_degree = 0;  ///< moments kept where sites are merged; 0: chosen from d and the budget
  /// A strategy of the caller's, made once for each tree; `method` then says what kind it is: tbba for one
  /// that counts particles, recombination for one that merges sites.
  std::function<std::unique_ptr<Thinning>()> own = {};
};

std::unique_ptr<Thinning> make_thinning(const ThinningOptions& options);

}  // namespace wienertree
