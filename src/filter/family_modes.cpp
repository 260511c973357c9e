#include "wienertree/filter/family_modes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "wienertree/filter/places.hpp"
#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double spacing = 0.25, grid_reach = 9, farthest = 1e4;
constexpr double negligible_depth = 45;  // e^-45 = 3e-20
constexpr double smooth_range = 0.5;     // of g over the bracket of a mode
constexpr double precision = 1e-9;       // of the integral, for each interval
constexpr int deepest = 40;
constexpr std::size_t most_modes = 64;

// Gauss-Legendre on [-1,1], 8 points (Abramowitz, Stegun 1964, table 25.4).
constexpr std::array<double, 4> legendre_node = {0.183434642495649805, 0.525532409916328986,
                                                 0.796666477413626740, 0.960289856497536232};
constexpr std::array<double, 4> legendre_weight = {0.362683783378361983, 0.313706645877887287,
                                                   0.222381034453374471, 0.101228536290376259};

double normal_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace

void FamilyModes::evaluate(std::span<const double> z, std::vector<double>& g) {
  const std::span<double> x = likelihood_->places(z.size());
  for (std::size_t n = 0; n < z.size(); ++n) x[n] = mean_ + sd_ * shape_(z[n]);
  const std::span<const double> F = likelihood_->evaluate();
  g.resize(z.size());
  for (std::size_t n = 0; n < z.size(); ++n) {
    const double value = F[n];
    if (value == infinity || (std::isnan(value) && z[n] == 0))
      throw RunError("the weight of a node is not finite",
                     fmt::format("{}, state {}", place_and_observation(likelihood_->window()),
                                 mean_ + sd_ * shape_(z[n])),
                     fmt::format("log-likelihood {}", value));
    g[n] = std::isnan(value) ? -infinity : value - z[n] * z[n] / 2;
  }
}

// The part of the line of z whose states are inside the bounds.
void FamilyModes::limit(const LineBounds& bounds) {
  low_ = -infinity;
  high_ = infinity;
  outside_ = 0;
  if (!bounds.bounded() || !(sd_ > 0)) return;
  if (bounds.lower > -infinity) low_ = shape_.inverse((bounds.lower - mean_) / sd_);
  if (bounds.upper < infinity) high_ = shape_.inverse((bounds.upper - mean_) / sd_);
  outside_ = normal_below(low_) + normal_below(-high_);
}

void FamilyModes::lay_grid() {
  grid_.clear();
  const double first = std::max(low_, -grid_reach), last = std::min(high_, grid_reach);
  // A family whose mean is on a bound has half its law inside.
  grid_.push_back(first);
  for (int k = -static_cast<int>(grid_reach / spacing); k * spacing < last; ++k)
    if (k * spacing > first) grid_.push_back(k * spacing);
  if (last > first) grid_.push_back(last);
  evaluate(grid_, value_);
}

// Beyond the grid while g grows there: an observation far out.
void FamilyModes::extend(int side) {
  const double bound = side > 0 ? high_ : low_;
  for (double z = side * grid_reach * 1.1; std::abs(z) < farthest && (side > 0 ? z < bound : z > bound);
       z *= 1.1) {
    z_.assign(1, z);
    evaluate(z_, g_);
    if (side > 0) {
      grid_.push_back(z);
      value_.push_back(g_[0]);
      if (g_[0] < value_[value_.size() - 2] - negligible_depth) return;
    } else {
      grid_.insert(grid_.begin(), z);
      value_.insert(value_.begin(), g_[0]);
      if (g_[0] < value_[1] - negligible_depth) return;
    }
  }
}

// Records the maxima inside (low, high): those of 9 points, each enclosed again between its neighbours. The
// ends count only where the grid ends.
void FamilyModes::enclose(double low, double high, int depth) {
  constexpr std::size_t parts = 8;
  std::array<double, parts + 1> z, g;
  for (std::size_t n = 0; n <= parts; ++n)
    z[n] = low + (high - low) * static_cast<double>(n) / static_cast<double>(parts);
  evaluate(z, g_);
  std::copy(g_.begin(), g_.end(), g.begin());
  const auto [least, most] = std::minmax_element(g.begin(), g.end());
  const auto best = static_cast<std::size_t>(most - g.begin());
  if (*most - *least < smooth_range || depth == deepest ||
      !(high - low > 1e-14 * std::max(1.0, std::abs(z[best])))) {
    modes_.push_back({z[best], g[best], (high - low) / 2});
    largest_ = std::max(largest_, g[best]);
    return;
  }
  for (std::size_t n = 0; n <= parts && modes_.size() < most_modes; ++n) {
    if (g[n] == -infinity) continue;
    if (n == 0 ? low > grid_.front() || g[1] >= g[0] : g[n - 1] > g[n]) continue;
    if (n == parts ? high < grid_.back() || g[n - 1] >= g[n] : g[n + 1] >= g[n]) continue;
    enclose(z[n == 0 ? 0 : n - 1], z[std::min(n + 1, parts)], depth + 1);
  }
}

double FamilyModes::find(FamilyLikelihood& likelihood, const Families& families, std::size_t i,
                         const LineBounds& bounds) {
  likelihood_ = &likelihood;
  mean_ = families.mean[i];
  sd_ = families.sd[i];
  shape_ = families.shape_of(i);
  limit(bounds);
  lay_grid();
  const auto largest_at = [&] {
    return static_cast<std::size_t>(std::max_element(value_.begin(), value_.end()) - value_.begin());
  };
  if (largest_at() == 0 && low_ < -grid_reach) extend(-1);
  if (largest_at() == grid_.size() - 1 && high_ > grid_reach) extend(1);
  modes_.clear();
  largest_ = -infinity;
  const std::size_t n = grid_.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (value_[k] == -infinity) continue;
    if ((k > 0 && value_[k - 1] > value_[k]) || (k + 1 < n && value_[k + 1] >= value_[k])) continue;
    enclose(grid_[k == 0 ? 0 : k - 1], grid_[std::min(k + 1, n - 1)], 0);
  }
  return largest_;
}

// Nodes and g at them; returns the integral of exp(g - largest).
double FamilyModes::legendre(double low, double high, std::vector<double>& z, std::vector<double>& g,
                             std::vector<double>& length) {
  const double centre = (low + high) / 2, half = (high - low) / 2;
  z.clear();
  length.clear();
  for (const double node : legendre_node)
    for (const int sign : {-1, 1}) z.push_back(centre + sign * half * node);
  evaluate(z, g);
  double sum = 0;
  for (std::size_t n = 0; n < g.size(); ++n) {
    length.push_back(legendre_weight[n / 2] * half);
    sum += length[n] * std::exp(g[n] - largest_);
  }
  return sum;
}

void FamilyModes::quadrature(std::span<const Mode> modes) {
  ends_.assign({grid_.front(), grid_.back()});
  for (const Mode& m : modes) {
    ends_.push_back(m.z);
    for (double step = m.delta; step < 8; step *= 3) {
      ends_.push_back(m.z - step);
      ends_.push_back(m.z + step);
    }
  }
  std::sort(ends_.begin(), ends_.end());
  const double first = grid_.front(), last = grid_.back();
  node_.clear();
  height_.clear();
  length_.clear();
  stack_.clear();
  double whole = 0;
  for (std::size_t k = 0; k + 1 < ends_.size(); ++k) {
    const double low = std::max(ends_[k], first), high = std::min(ends_[k + 1], last);
    if (!(high > low)) continue;
    stack_.push_back({low, high, legendre(low, high, z_, g_, z_length_), 0});
    whole += stack_.back().integral;
  }
  while (!stack_.empty()) {
    const Interval interval = stack_.back();
    stack_.pop_back();
    const double middle = interval.low + (interval.high - interval.low) / 2;
    const double left = legendre(interval.low, middle, z_, g_, z_length_);
    const double right = legendre(middle, interval.high, zb_, gb_, zb_length_);
    whole = std::max(whole, left + right);
    if (std::abs(left + right - interval.integral) <= precision * whole || interval.depth == deepest) {
      node_.insert(node_.end(), z_.begin(), z_.end());
      node_.insert(node_.end(), zb_.begin(), zb_.end());
      height_.insert(height_.end(), g_.begin(), g_.end());
      height_.insert(height_.end(), gb_.begin(), gb_.end());
      length_.insert(length_.end(), z_length_.begin(), z_length_.end());
      length_.insert(length_.end(), zb_length_.begin(), zb_length_.end());
      continue;
    }
    stack_.push_back({interval.low, middle, left, interval.depth + 1});
    stack_.push_back({middle, interval.high, right, interval.depth + 1});
  }
}

// Nodes come in intervals of 8, in which the integral of the interpolating polynomial, sum_k w_k P_m(t_k) f_k (2m + 1)/2
// times P_m, is known up to each of them.
void FamilyModes::tabulate(std::vector<double>& z, std::vector<double>& below, std::vector<double>& density) {
  constexpr std::size_t points = 8;
  // integral[j][k] = int_{-1}^{t_j} l_k, in the order in which `legendre` lays its nodes.
  static const auto integral = [] {
    std::array<double, points> t{}, w{};
    for (std::size_t n = 0; n < points; ++n) {
      t[n] = (n % 2 == 0 ? -1 : 1) * legendre_node[n / 2];
      w[n] = legendre_weight[n / 2];
    }
    const auto P = [](std::size_t m, double x) { return std::legendre(static_cast<unsigned>(m), x); };
    std::array<std::array<double, points>, points> table{};
    for (std::size_t j = 0; j < points; ++j)
      for (std::size_t k = 0; k < points; ++k) {
        double sum = (1 + t[j]) / 2;
        for (std::size_t m = 1; m < points; ++m) sum += P(m, t[k]) * (P(m + 1, t[j]) - P(m - 1, t[j])) / 2;
        table[j][k] = w[k] * sum;
      }
    return table;
  }();
  const std::size_t intervals = node_.size() / points;
  order_.resize(intervals);
  for (std::size_t i = 0; i < intervals; ++i) order_[i] = i;
  std::sort(order_.begin(), order_.end(),
            [&](std::size_t a, std::size_t b) { return node_[a * points] < node_[b * points]; });
  z.assign(1, grid_.front());
  below.assign(1, 0.0);
  density.assign(1, 0.0);
  double before = 0;
  for (const std::size_t i : order_) {
    const std::size_t first = i * points;
    std::array<double, points> f;
    std::array<std::size_t, points> sorted = {6, 4, 2, 0, 1, 3, 5, 7};
    double whole = 0;
    for (std::size_t n = 0; n < points; ++n) {
      f[n] = std::exp(height_[first + n] - largest_);
      whole += length_[first + n] * f[n];
    }
    const double half = length_[first] / legendre_weight[0];
    for (const std::size_t j : sorted) {
      double sum = 0;
      for (std::size_t k = 0; k < points; ++k) sum += integral[j][k] * f[k];
      z.push_back(node_[first + j]);
      below.push_back(before + half * sum);
      density.push_back(f[j]);
    }
    before += whole;
  }
  z.push_back(grid_.back());
  below.push_back(before);
  density.push_back(0.0);
  for (std::size_t n = 0; n < z.size(); ++n) {
    below[n] = std::clamp(below[n] / before, n == 0 ? 0.0 : below[n - 1], 1.0);
    density[n] /= before;
  }
  density.front() = density[1];
  density.back() = density[z.size() - 2];
}

void FamilyModes::compress(Part& part, std::span<const double> x, std::span<const double> w,
                           std::size_t points) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  const double centre = (*low + *high) / 2, half = (*high - *low) / 2;
  part.x.clear();
  part.share.clear();
  if (!(half > 0)) {
    part.x.push_back(centre);
    part.share.push_back(1);
    return;
  }
  zs_.resize(x.size());
  for (std::size_t n = 0; n < x.size(); ++n) zs_[n] = std::clamp((x[n] - centre) / half, -1.0, 1.0);
  const std::size_t found = gauss_.compute(zs_, w, std::min(points, x.size()));
  for (std::size_t k = 0; k < found; ++k) {
    part.x.push_back(centre + half * gauss_.nodes()[k]);
    part.share.push_back(gauss_.weights()[k]);
  }
}

void FamilyModes::cut_at_valleys(std::span<const Mode> modes) {
  const double valley_depth = std::log(2.0);
  cuts_.clear();
  for (std::size_t k = 0; k + 1 < modes.size(); ++k) {
    double least = infinity, at = 0;
    for (std::size_t n = 0; n < node_.size(); ++n)
      if (node_[n] > modes[k].z && node_[n] < modes[k + 1].z && height_[n] < least) {
        least = height_[n];
        at = node_[n];
      }
    if (least < std::min(modes[k].g, modes[k + 1].g) - valley_depth) cuts_.push_back(at);
  }
}

void FamilyModes::gather(std::size_t points) {
  const double inside = -0.5 * std::log(2 * std::numbers::pi) - std::log(1 - outside_);
  const std::vector<double>& cuts = cuts_;
  count_ = 0;
  for (std::size_t segment = 0; segment <= cuts.size(); ++segment) {
    const double from = segment == 0 ? -infinity : cuts[segment - 1];
    const double to = segment == cuts.size() ? infinity : cuts[segment];
    x_.clear();
    w_.clear();
    double mass = 0, mean = 0, second = 0, z1 = 0, z2 = 0;
    for (std::size_t n = 0; n < node_.size(); ++n) {
      if (!(node_[n] >= from && node_[n] < to)) continue;
      const double w = length_[n] * std::exp(height_[n] - largest_);
      if (!(w > 0)) continue;
      const double u = shape_(node_[n]);
      x_.push_back(mean_ + sd_ * u);
      w_.push_back(w);
      mass += w;
      mean += w * u;
      z1 += w * node_[n];
      z2 += w * node_[n] * node_[n];
    }
    if (!(mass > 0)) continue;
    mean /= mass;
    mean = mean_ + sd_ * mean;
    for (std::size_t n = 0; n < x_.size(); ++n) second += w_[n] * (x_[n] - mean) * (x_[n] - mean);
    if (parts_.size() == count_) parts_.emplace_back();
    Part& part = parts_[count_++];
    part.log_weight = largest_ + std::log(mass) + inside;
    part.mean = mean;
    part.variance = second / mass;
    part.z = z1 / mass;
    part.square = z2 / mass;
    compress(part, x_, w_, points);
  }
}

void FamilyModes::integrate(std::size_t points) {
  kept_.clear();
  for (const Mode& m : modes_)
    if (m.g >= largest_ - negligible_depth) kept_.push_back(m);
  std::sort(kept_.begin(), kept_.end(), [](const Mode& a, const Mode& b) { return a.z < b.z; });
  quadrature(kept_);
  cut_at_valleys(kept_);
  gather(points);
}

}  // namespace wienertree
