#include "wienertree/filter/line_density.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace wienertree {
namespace {

constexpr double visible = 1e-14;  // of the largest value
// Parts of the grid: what the support covers of one laid anew; between which it may lie; how much is kept
// free on either side; where mass may have been held up.
constexpr double placed = 0.6, narrow = 0.35, wide = 0.8, margin = 0.06, held_up = 0.005;
constexpr std::size_t terms = 4;  // of exp(-width^2/2 d^2/dx^2), after the first

}  // namespace

LineDensity::LineDensity(std::size_t cells, double lowest, double highest)
    : lowest_(lowest), highest_(highest), values_(cells), laid_(cells) {
  grid_.cells = cells;
}

double LineDensity::largest() const { return *std::max_element(values_.begin(), values_.end()); }

double LineDensity::mass() const {
  return grid_.width * std::accumulate(values_.begin(), values_.end(), 0.0);
}

void LineDensity::scale(double factor) {
  for (double& v : values_) v *= factor;
}

void LineDensity::lay_around(double low, double high) {
  const double middle = std::midpoint(low, high), half = (high - low) / 2 / placed;
  at_lowest_ = middle - half <= lowest_;
  at_highest_ = middle + half >= highest_;
  grid_.lower = at_lowest_ ? lowest_ : middle - half;
  grid_.width = ((at_highest_ ? highest_ : middle + half) - grid_.lower) / static_cast<double>(grid_.cells);
}

void LineDensity::set_gaussian(double mean, double variance) {
  const double reach = std::sqrt(-2 * variance * std::log(visible));
  lay_around(mean - reach, mean + reach);
  for (std::size_t i = 0; i < grid_.cells; ++i) {
    const double z = grid_.node(i) - mean;
    values_[i] = std::exp(-z * z / (2 * variance)) / std::sqrt(2 * std::numbers::pi * variance);
  }
}

void LineDensity::set_point(double x, double reach) {
  lay_around(x - reach, x + reach);
  std::fill(values_.begin(), values_.end(), 0.0);
  deposit(grid_, x, values_);
}

void LineDensity::set_interpolated(const LineDensity& other, double low, double high) {
  const LineGrid from = other.grid_;
  lay_around(low, high);
  interpolate(from, other.values_, grid_, laid_);
  values_.swap(laid_);
}

LineDensity::Support LineDensity::support() const {
  const double threshold = visible * largest();
  const auto seen = [&](double v) { return v > threshold; };
  const auto first = std::find_if(values_.begin(), values_.end(), seen);
  const auto last = std::find_if(values_.rbegin(), values_.rend(), seen);
  return {static_cast<std::size_t>(first - values_.begin()),
          values_.size() - 1 - static_cast<std::size_t>(last - values_.rbegin())};
}

bool LineDensity::has_room(Support s, double part) const {
  const double room = part * static_cast<double>(grid_.cells);
  return (at_lowest_ || static_cast<double>(s.first) >= room) &&
         (at_highest_ || static_cast<double>(grid_.cells - 1 - s.last) >= room);
}

bool LineDensity::reaches_an_end() const { return !has_room(support(), held_up); }

bool LineDensity::touches_a_bound() const {
  const Support s = support();
  return (at_lowest_ && s.first == 0) || (at_highest_ && s.last + 1 == grid_.cells);
}

bool LineDensity::is_narrow() const {
  const Support s = support();
  return static_cast<double>(s.last - s.first) < narrow * static_cast<double>(grid_.cells);
}

bool LineDensity::follow_mass() {
  const Support s = support();
  const bool crowded = static_cast<double>(s.last - s.first) > wide * static_cast<double>(grid_.cells) &&
                       !(at_lowest_ && at_highest_);
  if (!is_narrow() && !crowded && has_room(s, margin)) return false;
  const double before = mass();
  set_interpolated(*this, grid_.node(s.first), grid_.node(s.last));
  scale(before / mass());
  return true;
}

void LineDensity::widen() {
  const double middle = std::midpoint(grid_.lower, grid_.upper());
  const double half = 0.8 * placed * (grid_.upper() - grid_.lower), before = mass();
  set_interpolated(*this, middle - half, middle + half);
  scale(before / mass());
}

void LineDensity::gaussian_sum(std::span<double> point, std::span<double> weight,
                               std::vector<double>& scratch) const {
  static const std::vector<double> c = central_difference(4);
  const std::size_t n = values_.size(), m = c.size();
  // (width^2 d^2/dx^2)^j density, with m values on either side
  scratch.assign(2 * (n + 2 * m), 0.0);
  double *from = scratch.data() + m, *to = from + n + 2 * m;
  std::copy(values_.begin(), values_.end(), from);
  std::copy(values_.begin(), values_.end(), weight.begin());
  double factor = 1;  // (-1/2)^j / j!
  for (std::size_t j = 1; j <= terms; ++j) {
    factor *= -0.5 / static_cast<double>(j);
    for (std::size_t k = 0; k < m; ++k) {
      *(from - 1 - k) = at_lowest_ ? from[k] : 0.0;
      from[n + k] = at_highest_ ? from[n - 1 - k] : 0.0;
    }
    for (std::size_t i = 0; i < n; ++i) {
      to[i] = 0;
      for (std::size_t k = 1; k <= m; ++k)
        to[i] += 2 * c[k - 1] / static_cast<double>(k) * (from[i + k] - 2 * from[i] + *(from + i - k));
      weight[i] += factor * to[i];
    }
    std::swap(from, to);
  }
  for (double& w : weight) w = std::max(w, 0.0);
  const auto moments = [&](std::span<const double> mass) {
    double total = 0, first = 0, second = 0;
    for (std::size_t i = 0; i < n; ++i) {
      total += mass[i];
      first += mass[i] * grid_.node(i);
    }
    first /= total;
    for (std::size_t i = 0; i < n; ++i) second += mass[i] * (grid_.node(i) - first) * (grid_.node(i) - first);
    return std::array{total, first, second / total};
  };
  const auto [mass, mean, variance] = moments(values_);
  const auto [sum, centre, spread] = moments(weight);
  const double stretch = std::sqrt((variance - grid_.width * grid_.width) / spread);
  for (std::size_t i = 0; i < n; ++i) {
    point[i] = mean + stretch * (grid_.node(i) - centre);
    weight[i] /= sum;
  }
}

void LineDensity::exchange(StateArchive& archive) {
  archive(grid_.lower, grid_.width, at_lowest_, at_highest_, values_);
  StateArchive::require(values_.size() == grid_.cells);
}

}  // namespace wienertree
