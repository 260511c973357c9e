#include "wienertree/filter/marginal.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "wienertree/filter/family_law.hpp"
#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/lane_sum.hpp"

namespace wienertree {
namespace {

constexpr std::size_t most_gaussians = 512, width_classes = 16;

// h/S for so many families in so many dimensions. On the line the recommended 60 nodes lie regularly; in the plane and in
// space patches of the recommended 300 and 600 leave lumps as wide as they are. The width falls with the number, so
// that runs of other numbers of nodes tell its bias, of order h^8, with the rest.
double kernel_width(std::size_t dimension, std::size_t families) {
  const double usual = dimension == 1 ? 60 : dimension == 2 ? 300 : 600;
  const double width =
      (dimension == 1 ? 0.35 : 0.7) * std::pow(usual / static_cast<double>(families), 1.0 / 6);
  return std::clamp(width, 0.15, dimension == 1 ? 0.5 : 1.0);
}

// Components in which the nodes differ: a clock is none.
std::size_t varying(const ConstBatchView& points) {
  std::size_t number = 0;
  for (std::size_t i = 0; i < points.components(); ++i) {
    const auto x = points.component(i);
    number += std::ranges::any_of(x, [&](double v) { return v != x.front(); }) ? 1 : 0;
  }
  return std::max<std::size_t>(1, number);
}

// With z = (x - m)/s and rho = h^2/s^2, the operator of the header applied to N(m, s^2) (D^k phi = (-1)^k He_k phi):
// its density is phi(z)/s times this,
double density_factor(double z, double rho) {
  const double q = z * z;
  return 1 - rho / 2 * (q - 1) + rho * rho / 8 * (q * q - 6 * q + 3) -
         rho * rho * rho / 48 * (q * q * q - 15 * q * q + 45 * q - 15);
}

// and its distribution function is Phi(z) plus phi(z) times this.
double distribution_term(double z, double rho) {
  const double q = z * z;
  return z * (rho / 2 - rho * rho / 8 * (q - 3) + rho * rho * rho / 48 * (q * q - 10 * q + 15));
}

// He_k(z), k = 2..5.
struct Hermite {
  explicit Hermite(double z)
      : second(z * z - 1),
        third(z * second - 2 * z),
        fourth(z * third - 3 * second),
        fifth(z * fourth - 4 * third) {}
  double second, third, fourth, fifth;
};

// As many families as tell no more than moments.
std::size_t few_families(std::size_t dimension) { return dimension == 1 ? 12 : dimension == 2 ? 50 : 200; }

double normal_distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double normal_density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

struct Atom {
  double x, weight;
};

struct Range {
  double low, high;
};

WIENERTREE_CLONES Range range_of(std::span<const double> values) {
  const double* x = values.data();
  const std::size_t n = values.size();
  std::array<double, sum_lanes> low, high;
  low.fill(INFINITY);
  high.fill(-INFINITY);
  const auto visit = [&](std::size_t l, double v) {
    low[l] = v < low[l] ? v : low[l];
    high[l] = v > high[l] ? v : high[l];
  };
  std::size_t i = 0;
  for (; i + sum_lanes <= n; i += sum_lanes)
    for (std::size_t l = 0; l < sum_lanes; ++l) visit(l, x[i + l]);
  for (; i < n; ++i) visit(0, x[i]);
  return {*std::min_element(low.begin(), low.end()), *std::max_element(high.begin(), high.end())};
}

// Quantiles of Dirac masses in linear time: a histogram locates the atoms around each level, and only those
// are sorted.
class AtomQuantiles {
 public:
  AtomQuantiles(std::span<const double> x, std::span<const double> weight) : x_(x), weight_(weight) {
    const Range range = range_of(x);
    low_ = range.low;
    const double width = range.high - range.low, scale = static_cast<double>(buckets) / width;
    // Where width or scale overflow (atoms of both signs near 1e308, or all within 1e-305) all share a bucket.
    scale_ = std::isfinite(width) && std::isfinite(scale) ? scale : 0.0;
    for (std::size_t n = 0; n < x.size(); ++n) mass_[bucket(x[n])] += weight[n];
  }

  void at(std::span<const double> levels, std::span<double> out) {
    brackets_.clear();
    for (const double level : levels) brackets_.push_back(bracket(level));
    collect_atoms();
    for (std::size_t q = 0; q < levels.size(); ++q) out[q] = within(brackets_[q], levels[q]);
  }

 private:
  static constexpr std::size_t buckets = 1024;
  struct Bracket {
    std::size_t first, last;  ///< buckets
    double before;            ///< weight below them
  };

  std::size_t bucket(double x) const {
    // In this order what is not a number, as 0 times infinity, is 0.
    const double position = std::max(0.0, (x - low_) * scale_);
    return static_cast<std::size_t>(static_cast<std::int64_t>(std::min(buckets - 1.0, position)));
  }

  // The bucket where the cumulated weight passes the level, with its non-empty neighbours: the midpoints that
  // bracket the level belong to these.
  Bracket bracket(double level) const {
    std::size_t b = 0;
    double before = 0;
    while (b + 1 < buckets && before + mass_[b] < level) before += mass_[b++];
    std::size_t first = b, last = b;
    while (first > 0 && (first == b || mass_[first] == 0)) before -= mass_[--first];
    while (last + 1 < buckets && (last == b || mass_[last] == 0)) ++last;
    return {first, last, before};
  }

  void collect_atoms() {
    std::array<std::uint8_t, buckets> wanted{};
    for (const Bracket& b : brackets_)
      std::fill(wanted.begin() + static_cast<std::ptrdiff_t>(b.first),
                wanted.begin() + static_cast<std::ptrdiff_t>(b.last) + 1, std::uint8_t{1});
    atoms_.clear();
    for (std::size_t n = 0; n < x_.size(); ++n)
      if (wanted[bucket(x_[n])] != 0 && weight_[n] > 0) atoms_.push_back({x_[n], weight_[n]});
    std::sort(atoms_.begin(), atoms_.end(), [](const Atom& a, const Atom& b) { return a.x < b.x; });
  }

  double within(const Bracket& bracket, double level) const {
    double before = bracket.before, previous_x = x_[0], previous_level = -1;
    for (const Atom& a : atoms_) {
      if (bucket(a.x) < bracket.first) continue;
      if (bucket(a.x) > bracket.last) break;
      const double middle = before + a.weight / 2;
      if (middle >= level) {
        if (previous_level < 0) return a.x;
        if (const double gap = a.x - previous_x; std::isfinite(gap))
          return previous_x + gap * (level - previous_level) / (middle - previous_level);
        return std::lerp(previous_x, a.x, (level - previous_level) / (middle - previous_level));
      }
      previous_x = a.x;
      previous_level = middle;
      before += a.weight;
    }
    return previous_x;
  }

  std::span<const double> x_, weight_;
  double low_ = 0, scale_ = 0;
  std::array<double, buckets> mass_{};
  std::vector<Bracket> brackets_;
  std::vector<Atom> atoms_;
};

}  // namespace

Marginal::Marginal(const Posterior& posterior, std::size_t i)
    : atoms_(posterior.points.component(i)), weight_(posterior.weight) {
  std::vector<Family> families;
  if (posterior.law != nullptr && i == 0) {
    law_ = posterior.law;
    has_density_ = law_->has_density();
    return;
  }
  if (posterior.dirac() && posterior.parents == 0) return;
  if (posterior.dirac()) {
    add_families(posterior.parents, families);
  } else {
    for (std::size_t n = 0; n < posterior.size(); ++n)
      families.push_back({weight_[n], atoms_[n], posterior.variance_of(i, n)});
  }
  if (families.size() > most_gaussians) merge(families);
  // A family that an observation leaves one child is a point. Far out in the law, points of no mass are no
  // obstacle to a density: 1e-12 is that of rounding.
  double points = 0;
  for (const Family& f : families) {
    if (!(f.weight > 0)) continue;
    gaussians_.push_back({f.weight, f.mean, std::sqrt(f.variance)});
    if (!(f.variance > 0)) points += f.weight;
  }
  if (i < posterior.bounds.size()) bounds_ = posterior.bounds[i];
  if (posterior.dirac()) {
    const std::size_t dimension = varying(posterior.points);
    if (posterior.parents > few_families(dimension) || !expand(families))
      smooth(kernel_width(dimension, posterior.parents));
  }
  has_density_ = !gaussians_.empty() && (points < 1e-12 || expanded_ || gaussians_.front().kernel > 0);
}

// One Gaussian and its expansion in place of the families, if their moments allow it.
bool Marginal::expand(const std::vector<Family>& families) {
  double mean = 0, variance = 0;
  for (const Family& f : families) mean += f.weight * f.mean;
  for (const Family& f : families) variance += f.weight * ((f.mean - mean) * (f.mean - mean) + f.variance);
  const double sd = std::sqrt(variance);
  if (!(sd > 0)) return false;
  // E He_k(Z) of Z ~ N(m, 1 - v): the recursion of He_k with v in place of 1.
  std::array<double, 3> moment{};
  for (const Family& f : families) {
    const double m = (f.mean - mean) / sd, v = 1 - f.variance / variance, second = m * m - v;
    const double third = m * second - 2 * v * m, fourth = m * third - 3 * v * second;
    moment[0] += f.weight * third;
    moment[1] += f.weight * fourth;
    moment[2] += f.weight * (m * fourth - 4 * v * third);
  }
  if (!(std::abs(moment[0]) <= 0.5 && std::abs(moment[1]) <= 0.5)) return false;
  gaussians_.assign(1, {1, mean, sd});
  hermite_ = {moment[0] / 6, moment[1] / 24, moment[2] / 120};
  expanded_ = true;
  return true;
}

void Marginal::smooth(double kernel_width) {
  lowest_ = INFINITY, highest_ = -INFINITY;
  for (std::size_t n = 0; n < atoms_.size(); ++n) {
    if (!(weight_[n] > 0)) continue;
    lowest_ = std::min(lowest_, atoms_[n]);
    highest_ = std::max(highest_, atoms_[n]);
  }
  std::vector<Gaussian> sorted = gaussians_;
  std::ranges::sort(sorted, {}, &Gaussian::mean);
  double mean = 0, variance = 0;
  for (const Gaussian& g : sorted) mean += g.weight * g.mean;
  for (const Gaussian& g : sorted) variance += g.weight * ((g.mean - mean) * (g.mean - mean) + g.sd * g.sd);
  const double sd = std::sqrt(variance);
  if (!(sd > 0)) return;
  std::array<double, 24> place{};
  double before = 0;
  for (std::size_t k = 0, next = 0; k < sorted.size(); before += sorted[k++].weight)
    while (next < place.size() &&
           before + sorted[k].weight >= (static_cast<double>(next) + 0.5) / place.size())
      place[next++] = sorted[k].mean;
  const std::vector<Gaussian> plain = gaussians_;
  double S = sd;
  for (int k = 0; k < 4; ++k) {
    widen(plain, kernel_width * S);
    double peak = 0;
    for (const double x : place) peak = std::max(peak, sum_of_densities(x));
    const double narrower = std::clamp(1 / (std::sqrt(2 * std::numbers::pi) * peak), sd / 8, sd);
    if (narrower > 0.9 * S) return;
    S = narrower;
  }
  widen(plain, kernel_width * S);
}

void Marginal::widen(const std::vector<Gaussian>& plain, double h) {
  gaussians_ = plain;
  for (Gaussian& g : gaussians_) {
    const double total = g.sd * g.sd + h * h;
    g.kernel = h * h / total;
    g.sd = std::sqrt(total);
  }
}

// Mean and variance of each family, relative to its first child so that nothing cancels.
void Marginal::add_families(std::size_t parents, std::vector<Family>& out) const {
  out.assign(parents, {0, 0, 0});
  for (std::size_t first = 0; first < atoms_.size(); first += parents)
    for (std::size_t m = 0; m < parents; ++m) {
      const double w = weight_[first + m], x = atoms_[first + m] - atoms_[m];
      out[m].weight += w;
      out[m].mean += w * x;
      out[m].variance += w * x * x;
    }
  for (std::size_t m = 0; m < parents; ++m) {
    Family& f = out[m];
    if (!(f.weight > 0)) continue;
    f.mean /= f.weight;
    f.variance = std::max(0.0, f.variance / f.weight - f.mean * f.mean);
    f.mean += atoms_[m];
  }
}

void Marginal::merge(std::vector<Family>& families) {
  double mean = 0, second = 0;
  for (const Family& f : families) mean += f.weight * f.mean;
  for (const Family& f : families) second += f.weight * (f.variance + (f.mean - mean) * (f.mean - mean));
  const double low = mean - 8 * std::sqrt(second), width = 16 * std::sqrt(second) / most_gaussians;
  std::vector<Family> cells(most_gaussians * width_classes, {0, 0, 0});
  for (const Family& f : families) {
    const double position = width > 0 && std::isfinite(width) && std::isfinite(f.mean)
                                ? std::clamp((f.mean - low) / width, 0.0, most_gaussians - 1.0)
                                : 0.0;
    // Classes of a factor 2 in variance, down to 2^-15 of the whole law's.
    const double halvings =
        f.variance > 0 && second > 0 ? std::log2(second / f.variance) : width_classes - 1.0;
    const double width_class = std::clamp(std::floor(halvings), 0.0, width_classes - 1.0);
    Family& cell =
        cells[static_cast<std::size_t>(width_class) * most_gaussians + static_cast<std::size_t>(position)];
    cell.weight += f.weight;
    cell.mean += f.weight * (f.mean - mean);
    cell.variance += f.weight * (f.variance + (f.mean - mean) * (f.mean - mean));
  }
  for (Family& cell : cells) {
    if (!(cell.weight > 0)) continue;
    cell.mean /= cell.weight;
    cell.variance = std::max(0.0, cell.variance / cell.weight - cell.mean * cell.mean);
    cell.mean += mean;
  }
  std::erase_if(cells, [](const Family& cell) { return !(cell.weight > 0); });
  families.swap(cells);
}

double Marginal::distribution(double x) const {
  if (law_ != nullptr) return law_->distribution(x);
  double sum = 0;
  for (const Gaussian& g : gaussians_) {
    if (!(g.sd > 0)) {
      sum += g.mean <= x ? g.weight : 0.0;
      continue;
    }
    const double z = (x - g.mean) / g.sd;
    sum += g.weight * normal_distribution(z);
    if (g.kernel > 0) sum += g.weight * normal_density(z) * distribution_term(z, g.kernel);
  }
  if (expanded_) {  // phi He_k is the derivative of -phi He_{k-1}
    const double z = (x - gaussians_.front().mean) / gaussians_.front().sd;
    const Hermite h(z);
    sum -= normal_density(z) * (hermite_[0] * h.second + hermite_[1] * h.third + hermite_[2] * h.fourth);
  }
  if (gaussians_.empty())
    for (std::size_t n = 0; n < atoms_.size(); ++n) sum += atoms_[n] <= x ? weight_[n] : 0.0;
  return sum;
}

double Marginal::density(double x) const {
  assert(has_density());
  if (law_ != nullptr) return law_->density(x);
  return std::max(0.0, sum_of_densities(x));
}

double Marginal::sum_of_densities(double x) const {
  double sum = 0;
  for (const Gaussian& g : gaussians_) {
    if (!(g.sd > 0)) continue;
    const double z = (x - g.mean) / g.sd;
    sum += g.weight * normal_density(z) * density_factor(z, g.kernel) / g.sd;
  }
  if (expanded_) {
    const Gaussian& g = gaussians_.front();
    const double z = (x - g.mean) / g.sd;
    const Hermite h(z);
    sum +=
        normal_density(z) * (hermite_[0] * h.third + hermite_[1] * h.fourth + hermite_[2] * h.fifth) / g.sd;
  }
  return sum;
}

double Marginal::gaussian_quantile(double level) const {
  double low = INFINITY, high = -INFINITY;
  for (const Gaussian& g : gaussians_) {
    low = std::min(low, g.mean - 40 * g.sd);
    high = std::max(high, g.mean + 40 * g.sd);
  }
  // Newton's step where it stays inside the bracket and there is a density, else bisection, to 1e-12 of the
  // bracket's width.
  double x = low + (high - low) / 2;
  const double resolution = 1e-12 * (high - low);
  for (int k = 0; k < 200 && high - low > resolution; ++k) {
    const double excess = distribution(x) - level;
    (excess < 0 ? low : high) = x;
    const double slope = has_density() ? density(x) : 0.0;
    const double step = slope > 0 ? excess / slope : INFINITY;
    if (std::abs(step) < resolution) return x - step;
    x = x - step > low && x - step < high ? x - step : low + (high - low) / 2;
  }
  return high;
}

void Marginal::quantiles(std::span<const double> levels, std::span<double> out) const {
  if (law_ != nullptr) return law_->quantiles(levels, out);
  if (!gaussians_.empty()) {
    for (std::size_t q = 0; q < levels.size(); ++q) {
      out[q] = gaussian_quantile(levels[q]);
      if (gaussians_.front().kernel > 0) out[q] = std::clamp(out[q], lowest_, highest_);
      out[q] = std::clamp(out[q], bounds_.lower, bounds_.upper);
    }
    return;
  }
  AtomQuantiles(atoms_, weight_).at(levels, out);
}

}  // namespace wienertree
