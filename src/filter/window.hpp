#pragma once
/// What a filter consumes: the observation over one step.
#include <cstddef>
#include <span>
#include <vector>

#include "wienertree/filter/observations.hpp"

namespace wienertree {

/// The observation over [start, end]. With U_u = Y_end - Y_u:
///     increment   D = Y_end - Y_start                                  (k)
///     integral    I = int_start^end U_u du                             (k)
///     covariation C = int U_u U_u^T du - I I^T / s,  s = end - start   (k x k, row-major)
/// and, b a Brownian bridge on [0,s], the covariances of int b dY with int (1 - u/s) b_u du and with
/// int (u/s) b_u du, which are
///     bridge_start = (s/3) I - J_1 + J_2/(2s),   bridge_end = (s/6) I - J_2/(2s),
///     J_m = int (u - start)^m U_u du                                   (k each).
/// Y is known at the rows alone, and its likelihood is that of its increments, in which the mean of h over each gap
/// stands: the integrals are those of the path that is linear between rows, and
///     bridge = sum delta^2/6 over the gaps delta,  which is added to the diagonal of C.
/// For with hbar the mean of h over a gap, the increments' log-likelihood h.D - (delta/2) |hbar|^2 exceeds that of the
/// linear path by 1/2 int |h - hbar|^2, which is delta^2/12 |G|^2 on average for h = G b, b a Brownian motion. The path
/// that is truly linear between rows has bridge 0.
struct ObservationWindow {
  std::size_t step = 0;  ///< number of the step, from 1
  double start = 0, end = 0;

  std::span<const double> row_times;   ///< continuous: rows of [start, end], first and last included
  std::span<const double> row_values;  ///< their values, rows x k
  std::vector<double> increment, integral, covariation, bridge_start, bridge_end;
  double bridge = 0;  ///< time^2

  /// Discrete: the observation to weigh by, or empty. `at_start`: it is a function of the state at `start`
  /// (timing "previous"), else of the state at `end`. A window of length zero weighs without moving.
  std::vector<double> observation;
  bool at_start = false;

  double length() const { return end - start; }
  std::size_t rows() const { return row_times.size(); }
};

/// Cuts an observation record into windows.
///
/// Continuous: the grid's points are moved to the nearest row, since Y is known only there. Discrete: every
/// row ends a window; the gap before it is divided into as many equal steps as keep each at most as long as
/// the grid asks for.
class ObservationWindows {
 public:
  /// @param steps number of steps n; 0 means one for every row. Windows refer to the rows, which must outlive
  /// them.
  /// @param jumps times at which a coefficient jumps, in order. Steps end there as well; of a continuous record at
  /// the first row from there on, since Y is known at rows alone.
  /// @throws InputError if steps exceeds the number of gaps between rows (continuous), or is smaller than it
  /// (discrete), or a first row is given where timing "previous" has no earlier state
  ObservationWindows(ObservationRows rows, ObservationKind kind, ObservationTiming timing, std::size_t steps,
                     std::span<const double> jumps = {});
  /// Of a continuous record, from each of `boundaries` to the next: row numbers that increase, the first 0.
  /// @param linear whether Y is taken to be linear between rows: bridge = 0
  ObservationWindows(ObservationRows rows, std::span<const std::size_t> boundaries, bool linear = false);
  std::size_t size() const { return windows_.size(); }
  /// Window j = 0..size()-1; buffers of `out` are reused.
  void get(std::size_t j, ObservationWindow& out) const;
  double start() const { return rows_.times.front(); }
  double end() const { return rows_.times.back(); }
  double time(std::size_t j) const { return windows_[j].end; }

 private:
  struct Bounds {
    double start, end;
    std::size_t first_row, last_row;  ///< continuous: rows inside; discrete: last_row is the row observed
    bool observed, at_start;
  };
  ObservationRows rows_;
  ObservationKind kind_;
  bool linear_ = false;
  std::vector<Bounds> windows_;
};

/// `rows` and, in order with them, the first row from each of `jumps` on, where it lies inside.
std::vector<std::size_t> rows_with_jumps(std::vector<std::size_t> rows, std::span<const double> times,
                                         std::span<const double> jumps);

/// Row numbers nearest to a uniform grid of n steps, strictly increasing, from the first row to the last.
/// @pre 1 <= n < number of times
std::vector<std::size_t> rows_on_grid(std::span<const double> times, std::size_t n);

/// Fills increment, integral, covariation and bridge of a continuous window from its rows.
void integrate_rows(ObservationWindow& window, std::size_t dimension, bool linear = false);

}  // namespace wienertree
