#pragma once
/// Seam 5: consumes observation windows, yields posteriors.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "wienertree/cubature/flow.hpp"
#include "wienertree/cubature/formula.hpp"
#include "wienertree/filter/functional.hpp"
#include "wienertree/filter/posterior.hpp"
#include "wienertree/filter/warning.hpp"
#include "wienertree/filter/weights.hpp"
#include "wienertree/filter/window.hpp"
#include "wienertree/model/model.hpp"
#include "wienertree/numeric/memory.hpp"
#include "wienertree/numeric/state_archive.hpp"
#include "wienertree/thinning/thinning.hpp"
#include "wienertree/tree/generation.hpp"

namespace wienertree {

/// Counters since the start of a filter; a run's report is made of them.
struct FilterStatistics {
  FlowStatistics flow;
  std::uint64_t steps = 0;
  std::uint64_t children = 0;       ///< nodes grown, or cells of a grid moved, over all steps
  std::uint64_t dropped_nodes = 0;  ///< nodes that could not be moved and were dropped, as asked
  std::uint64_t conditioned =
      0;                 ///< components confronted with an observation, parts of divided ones among them
  double discarded = 0;  ///< sum of Selection::discarded over the steps
};

void exchange(StateArchive& archive, FilterStatistics& statistics);

/// Of a filter that compares the model with noise alone: what its particles' likelihood ratios L say.
struct LikelihoodRatio {
  double log_mean = 0;  ///< log of the mean of L: the log Bayes factor of the model against noise
  double log_variance =
      0;  ///< log of the empirical variance of L over the particles; -infinity if they are equal
  double effective_size = 0;
  /// Below 10 effective particles the mean has a relative standard error above 30 %, and that estimate
  /// itself, made of so few particles, is too small.
  bool collapsed() const { return effective_size < 10; }
};

void exchange(StateArchive& archive, LikelihoodRatio& ratio);

/// One step each: `advance` takes the next window, `posterior` is the law at its end.
class Filter {
 public:
  virtual ~Filter() = default;
  /// @throws RunError naming step, time and observation when no node has positive weight; naming step, time,
  /// node and state when a node cannot be moved
  virtual void advance(const ObservationWindow& window) = 0;
  /// Valid until the next `advance`.
  virtual const Posterior& posterior() = 0;
  virtual std::string_view name() const = 0;
  /// The current generation of nodes and how it came from the one before, for filters that keep nodes, else
  /// nullptr.
  virtual const Generation* generation() const { return nullptr; }
  /// For filters that keep likelihood ratios, else nothing.
  virtual std::optional<LikelihoodRatio> likelihood_ratio() { return {}; }
  const FilterStatistics& statistics() const { return statistics_; }
  /// What it has seen since its start that makes its answer doubtful, one entry for each kind.
  const std::vector<FilterWarning>& warnings() const { return warnings_; }
  /// Writes or reads all that later steps depend on. A filter that was made with the same arguments (but for
  /// the number of threads) and has read what another wrote goes on with the same bytes; its posterior is
  /// defined from its next step on.
  /// @throws InputError for bytes that are not the state of such a filter
  void exchange(StateArchive& archive);

 protected:
  virtual void exchange_state(StateArchive& archive) = 0;
  FilterStatistics statistics_;
  std::vector<FilterWarning> warnings_;
};

enum class FilterMethod {
  klv,
  full_tree,
  euler,
  gaussian_mixture,
  weighted,
  benes,
  kalman_bucy,
  kalman,
  grid
};

/// Which weights decide where the particles go (Crisan, Ortiz-Latorre 2013, versions 1 and 2).
enum class PruneWeights {
  cubature,    ///< cubature weights alone; likelihoods are carried along, each with its path: not for
               ///< recombination
  likelihood,  ///< cubature weights times likelihoods
};

enum class OnNodeFailure { stop, drop };

/// How the KLV filter takes in a discrete observation. With `families` and `components` a window is the whole gap
/// before the observation, and the filter chooses its substeps.
enum class Conditioning {
  children,    ///< every child is weighed by the density at its place
  families,    ///< d = 1: the law of a node's children over the last substep is conditioned
  components,  ///< nodes are Gaussians with covariances, moved by their moment equations and conditioned
};

struct FilterOptions {
  FilterMethod method = FilterMethod::klv;
  CubatureFormula formula;   ///< tree methods: dimension p of the model
  std::size_t nodes = 1000;  ///< N
  ThinningOptions thinning;
  PruneWeights prune_weights = PruneWeights::likelihood;
  FunctionalMethod functional = FunctionalMethod::second_order;
  Conditioning conditioning = Conditioning::children;
  /// Families and components: how far from Gaussian (skewness, excess kurtosis; in d > 1 the non-affine part of the
  /// drift in standard deviations of a family) the law of a family may be over the last substep before an observation.
  double substep_tolerance = 0.1;
  /// A likelihood of the caller's in place of `functional`; made once for each filter.
  std::function<std::unique_ptr<Functional>()> own_functional = {};
  /// Random thinning lets likelihoods decide when their effective sample size is at most this fraction F of
  /// what it is when all are equal. Euler: particles are resampled then, and not before. Tree: children are
  /// always thinned to N, before by cubature weights alone, the likelihoods carried; F = 1 lets them decide
  /// at every step. Either way the evidence stays unbiased.
  double ess_threshold = 1.0;
  std::optional<double>
      alpha;        ///< Gaussian mixture: part of the noise that spreads the Gaussians; N^{-1/2} if none
  double beta = 0;  ///< Gaussian mixture: offspring have variance alpha beta
  FlowMethod flow = FlowMethod::automatic;
  FlowTolerance tolerance;
  OnNodeFailure on_node_failure = OnNodeFailure::stop;
  std::uint64_t seed = 1;
  std::uint32_t launch = 0;
  unsigned threads = 1;
  /// A filter, or a step of an unpruned tree, that would need more memory than this, in bytes, is refused.
  double memory_limit = wienertree::memory_limit();
  /// Grid filter: number of cells, and the longest step in units of the density's own time scale.
  std::size_t grid_points = 400;
  double grid_step = 0.25;
};

std::unique_ptr<Functional> make_functional(const FilterOptions& options);

/// The model is copied (its fields are shared). @throws InputError if an option does not fit the model or
/// another option
std::unique_ptr<Filter> make_filter(const Model& model, const FilterOptions& options);

/// @throws InputError with the tree's size and the options that avoid it, if it exceeds options.memory_limit
void refuse_oversized_tree(const Model& model, const FilterOptions& options, std::size_t steps);

/// Runs the filter over all windows and hands each posterior to `observe` (may be empty).
void run(Filter& filter, const ObservationWindows& windows,
         const std::function<void(const Posterior&)>& observe);

}  // namespace wienertree
