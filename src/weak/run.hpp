#pragma once
/// A weak approximation as it is asked for: a number of steps, launches to be averaged, Richardson's
/// extrapolation.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "wienertree/weak/weak_approximation.hpp"

namespace wienertree {

struct WeakRun {
  WeakOptions options;  ///< grid and launch are filled in
  GridKind grid = GridKind::uniform;
  double horizon = 1;  ///< T
  /// Several times to report at, ascending, the last one T; empty: T alone.
  std::vector<double> horizons = {};
  std::size_t steps = 10;                        ///< n to the last time; with several, about as many
  double gamma = 1;                              ///< of Kusuoka's grid
  std::uint32_t launches = 1, first_launch = 0;  ///< launches from first_launch on
  /// Also from ceil(n/2) steps, and the two extrapolated.
  bool richardson = false;
  /// Times inside (0, T) at which steps are to end as well, ascending: inputs jump there.
  std::vector<double> jumps = {};
  /// Whether payoffs have kinks or jumps at several times: the first then has as many steps as alone.
  bool kinks_at_times = false;
};

/// Per payoff, time by time where there are several. Standard errors are those of the average of the
/// launches, 0 where nothing is random.
struct WeakResult {
  std::vector<double> value, standard_error;
  /// Empty unless asked for:  V_n + (V_n - V_k) / ((n/k)^q - 1),  k = ceil(n/2),  which takes the leading
  /// term C n^{-q}, q = (m-1)/2, from the error of degree m (Talay, Tubaro 1990; Kusuoka 2001).
  std::vector<double> extrapolated, extrapolated_standard_error;
  std::vector<std::size_t> carriers;  ///< see WeakEstimate
  std::size_t leaves = 0;             ///< of the last launch with n steps
  std::uint64_t ode_solves = 0;       ///< of all trees
  double discarded = 0;               ///< of the tree with n steps: see WeakEstimate
};

/// @throws InputError as weak_approximation; if launches or n are 0, or n < 2 with richardson
WeakResult run_weak(const Model& model, const std::vector<WeakPayoff>& payoffs, const WeakRun& run);

/// Level m of the grid: the steps in each interval. With one time and no jumps m. With several times m f_k, at least 1,
///
///     f_k the power of 2 next to (T_k - T_{k-1}) / sqrt(T_k T),
///
/// between steps of equal length, which late times need, and steps in proportion to the time at which they are looked
/// at, which kinks at early times need. To the first time m where payoffs have kinks, otherwise at least 4 (m, where
/// that is less). With jumps m f_k, at least 1, in each interval between times, of a horizon or of
/// a jump, f_k the power of 2 next to (T_k - T_{k-1}) / T.
std::vector<std::size_t> interval_steps(const WeakRun& run, std::size_t m);

/// ceil(n_k / 2) for each interval: the coarser tree of an extrapolation.
std::vector<std::size_t> halved(std::vector<std::size_t> counts);

/// All steps of level m together.
std::size_t steps_of_level(const WeakRun& run, std::size_t m);

/// The times in (0, horizon) at which an input of the model jumps.
std::vector<double> jumps_inside(const Model& model, double horizon);

/// The level with about run.steps steps, >= 1.
std::size_t level_of(const WeakRun& run);

/// Fills in the grid with `counts` steps in the intervals, and the steps to report at.
void set_grid(const WeakRun& run, const std::vector<std::size_t>& counts, WeakOptions& options);

/// Whether the seed changes the result.
bool is_random(const WeakOptions& options);

/// From V_k and V_n, k < n, as above.
double extrapolate(double coarse, double fine, std::size_t k, std::size_t n, int degree);

}  // namespace wienertree
