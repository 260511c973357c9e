#include "wienertree/filter/window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "wienertree/filter/row_integrals.hpp"
#include "wienertree/numeric/memory.hpp"

namespace wienertree {

// n <= rows - 1 makes this possible: point j may not go below the point before it plus one, nor above the row that
// leaves one for each point to come.
std::vector<std::size_t> rows_on_grid(std::span<const double> t, std::size_t n) {
  std::vector<std::size_t> rows(n + 1, 0);
  const double T = t.back() - t.front();
  for (std::size_t j = 1; j <= n; ++j) {
    const double target = t.front() + T * static_cast<double>(j) / static_cast<double>(n);
    auto r = static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), target) - t.begin());
    if (r == t.size() || (r > 0 && target - t[r - 1] < t[r] - target)) --r;
    rows[j] = std::clamp(r, rows[j - 1] + 1, t.size() - 1 - (n - j));
  }
  return rows;
}

std::vector<std::size_t> rows_with_jumps(std::vector<std::size_t> rows, std::span<const double> times,
                                         std::span<const double> jumps) {
  if (jumps.empty()) return rows;
  for (const double jump : jumps) {
    const auto r =
        static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), jump) - times.begin());
    if (r > rows.front() && r < rows.back()) rows.push_back(r);
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

namespace {

// The jumps inside (from, to), apart from both by more than rounding, and `to`.
std::vector<double> ends_of_pieces(double from, double to, std::span<const double> jumps) {
  const double rounding =
      8 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(from), std::fabs(to));
  std::vector<double> ends;
  for (auto j = std::upper_bound(jumps.begin(), jumps.end(), from + rounding);
       j != jumps.end() && *j < to - rounding; ++j)
    ends.push_back(*j);
  ends.push_back(to);
  return ends;
}

}  // namespace

ObservationWindows::ObservationWindows(ObservationRows path, ObservationKind kind, ObservationTiming timing,
                                       std::size_t steps, std::span<const double> jumps)
    : rows_(path), kind_(kind) {
  const std::span<const double> t = path.times;
  const std::size_t gaps = path.rows() - 1;
  if (!std::isfinite(t.back() - t.front()))
    throw InputError("the times lie further apart than a double represents",
                     fmt::format("observations: row {}, column t", path.rows()), fmt::format("{}", t.back()));
  if (kind == ObservationKind::continuous) {
    if (steps > gaps)
      throw InputError(fmt::format("more steps than the observation has gaps between rows ({})", gaps),
                       "steps", std::to_string(steps));
    const auto rows = rows_with_jumps(rows_on_grid(t, steps == 0 ? gaps : steps), t, jumps);
    for (std::size_t j = 1; j < rows.size(); ++j)
      windows_.push_back({t[rows[j - 1]], t[rows[j]], rows[j - 1], rows[j], false, false});
    return;
  }
  if (steps != 0 && steps < gaps)
    throw InputError(fmt::format("fewer steps than gaps between discrete observations ({})", gaps), "steps",
                     std::to_string(steps));
  const bool previous = timing == ObservationTiming::previous;
  const auto present = [&](std::size_t r) {
    return std::any_of(path.row(r).begin(), path.row(r).end(), [](double y) { return !std::isnan(y); });
  };
  if (present(0)) {
    if (previous)
      throw InputError(
          "with timing = \"previous\" the first row has no earlier state to observe: leave its values empty",
          "observations: row 1");
    windows_.push_back({t[0], t[0], 0, 0, true, false});
  }
  // Every gap is cut into as many steps as it holds, or one.
  require_memory(static_cast<double>(sizeof(Bounds)) * static_cast<double>(std::max(steps, gaps)) * 2,
                 fmt::format("a record cut into {} steps", std::max(steps, gaps)), "--steps");
  const double longest = steps == 0 ? INFINITY : (t.back() - t.front()) / static_cast<double>(steps);
  for (std::size_t r = 1; r < path.rows(); ++r) {
    // Between two times there are at most as many others as there are doubles.
    const double spacing = 4 * std::numeric_limits<double>::epsilon() *
                           std::max(std::fabs(t[r - 1]), std::fabs(t[r])),
                 shortest = std::max(spacing, std::numeric_limits<double>::min());
    const std::vector<double> ends = ends_of_pieces(t[r - 1], t[r], jumps);
    double from = t[r - 1];
    for (const double to : ends) {
      const double gap = to - from;
      // 1e-9 relative: a gap of exactly `longest` up to rounding is one step.
      const double wanted = std::max(1.0, std::ceil(gap / longest * (1 - 1e-9)));
      if (wanted > 1 && !(gap / wanted >= shortest))
        throw InputError(fmt::format("the gap between these times is too short for {:g} steps", wanted),
                         fmt::format("observations: row {}, column t", r + 1), fmt::format("{}", t[r]));
      const auto parts = static_cast<std::size_t>(wanted);
      for (std::size_t i = 1; i <= parts; ++i) {
        const auto at = [&](std::size_t part) {
          return part == parts ? to : from + gap * static_cast<double>(part) / static_cast<double>(parts);
        };
        const bool weighs = previous ? i == 1 && from == t[r - 1] : i == parts && to == t[r];
        windows_.push_back({at(i - 1), at(i), r, r, present(r) && weighs, previous});
      }
      from = to;
    }
  }
}

ObservationWindows::ObservationWindows(ObservationRows path, std::span<const std::size_t> boundaries,
                                       bool linear)
    : rows_(path), kind_(ObservationKind::continuous), linear_(linear) {
  for (std::size_t j = 1; j < boundaries.size(); ++j)
    windows_.push_back({path.times[boundaries[j - 1]], path.times[boundaries[j]], boundaries[j - 1],
                        boundaries[j], false, false});
}

void ObservationWindows::get(std::size_t j, ObservationWindow& out) const {
  const Bounds& w = windows_[j];
  out.step = j + 1;
  out.start = w.start;
  out.end = w.end;
  if (kind_ == ObservationKind::continuous) {
    const std::size_t rows = w.last_row - w.first_row + 1, k = rows_.dimension;
    out.row_times = {rows_.times.data() + w.first_row, rows};
    out.row_values = {rows_.values.data() + w.first_row * k, rows * k};
    integrate_rows(out, k, linear_);
  } else {
    out.at_start = w.at_start;
    out.observation.clear();
    if (w.observed) out.observation.assign(rows_.row(w.last_row).begin(), rows_.row(w.last_row).end());
  }
}

void integrate_rows(ObservationWindow& window, std::size_t k, bool linear) {
  const std::size_t gaps = window.rows() - 1;
  const double s = window.length();
  const double *t = window.row_times.data(), *y = window.row_values.data();
  for (auto* v : {&window.increment, &window.integral, &window.bridge_start, &window.bridge_end})
    v->resize(k);
  window.covariation.assign(k * k, 0.0);
  window.bridge = linear ? 0.0 : row_bridge_variance(t, gaps);
  for (std::size_t i = 0; i < k; ++i) {
    window.increment[i] = y[gaps * k + i] - y[i];
    const RowIntegrals r = row_integrals(t, y + i, k, gaps);
    window.integral[i] = r.i0;
    window.bridge_start[i] = s / 3 * r.i0 - r.j1 + r.j2 / (2 * s);
    window.bridge_end[i] = s / 6 * r.i0 - r.j2 / (2 * s);
  }
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t l = 0; l <= i; ++l) {
      double& c = window.covariation[i * k + l];
      c = row_products(t, y + i, y + l, k, gaps) - window.integral[i] * window.integral[l] / s;
      if (i == l) c += window.bridge;
      window.covariation[l * k + i] = c;
    }
}

}  // namespace wienertree
