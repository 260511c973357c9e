#include "wienertree/thinning/recombination/line.hpp"

#include <algorithm>
#include <cmath>

#include "wienertree/numeric/log_weights.hpp"
#include "wienertree/thinning/recombination/vectors.hpp"

namespace wienertree::recombination {
namespace {

double integer_power(double base, std::size_t exponent) {
  double result = 1;
  for (; exponent > 0; exponent /= 2, base *= base)
    if (exponent % 2 == 1) result *= base;
  return result;
}

/// The cut of the line of which every patch but those of s points stays below an error.
class LineCut {
 public:
  LineCut(std::span<const double> x, std::span<const double> cumulative, std::size_t s)
      : x_(x), cumulative_(cumulative), s_(s), extent_(x.back() - x.front()) {}

  double error(std::size_t begin, std::size_t end) const {
    const double mass = (cumulative_[end] - cumulative_[begin]) / cumulative_.back();
    return std::max(mass, 0.0) * integer_power((x_[end - 1] - x_[begin]) / extent_, 2 * s_);
  }

  /// Number of patches, or `most` + 1 if more; writes their begins when `begin` is not null.
  std::size_t count(double largest_error, std::size_t most, std::vector<std::size_t>* begin) const {
    const std::size_t n = x_.size();
    std::size_t patches = 0;
    for (std::size_t first = 0; first < n && patches <= most; ++patches) {
      if (begin) begin->push_back(first);
      first = end_of(first, largest_error);
    }
    return patches;
  }

 private:
  // The error grows with the end: doubling steps, then bisection.
  std::size_t end_of(std::size_t first, double largest_error) const {
    const std::size_t n = x_.size();
    std::size_t good = std::min(first + s_, n), step = s_;
    if (good == n || error(first, good) > largest_error) return good;
    while (good + step < n && error(first, good + step) <= largest_error) {
      good += step;
      step *= 2;
    }
    std::size_t bad = good + step < n ? good + step : n + 1;
    while (bad - good > 1) {
      const std::size_t middle = good + (bad - good) / 2;
      (error(first, middle) <= largest_error ? good : bad) = middle;
    }
    return good;
  }

  std::span<const double> x_, cumulative_;
  std::size_t s_;
  double extent_;
};

}  // namespace

LineRule line_rule(int degree, std::size_t budget) {
  if (degree > 0) {
    const std::size_t nodes = std::min(static_cast<std::size_t>(degree) / 2 + 1, budget);
    return {nodes, budget / nodes};
  }
  constexpr std::size_t single = 10, most = 16;
  const std::size_t patches = budget <= single ? 1 : std::max<std::size_t>(2, (budget + most - 1) / most);
  return {budget / patches, patches};
}

void cut_line(std::span<const double> x, std::span<const double> cumulative, LineRule rule,
              std::vector<std::size_t>& begin) {
  begin.assign(1, 0);
  if (rule.patches > 1 && x.front() < x.back()) {
    const LineCut cut(x, cumulative, rule.nodes);
    // Equal errors of K patches of a uniform measure are K^-(2s+1) of the whole's. From a power of two below,
    // the threshold is bisected on a logarithmic scale to a factor 4, which is a factor 4^(1/2s) in width.
    double high = cut.error(0, x.size());
    double low = high;
    do {
      low *= std::max(std::pow(static_cast<double>(rule.patches), -2.0 * static_cast<double>(rule.nodes)),
                      1e-30);
    } while (low > 0 && cut.count(low, rule.patches, nullptr) <= rule.patches);
    low = std::max(low, 1e-300);
    while (low < high / 4) {
      const double middle = std::sqrt(low) * std::sqrt(high);
      (cut.count(middle, rule.patches, nullptr) <= rule.patches ? high : low) = middle;
    }
    begin.clear();
    cut.count(high, rule.patches, &begin);
  }
  begin.push_back(x.size());
}

void cut_evenly(std::span<const double> xi, std::span<const double> cumulative, double width,
                std::size_t most, std::vector<std::size_t>& begin) {
  const std::size_t n = xi.size();
  begin.assign(1, 0);
  const double negligible = 1e-20 * cumulative.back();
  std::size_t first = 0, last = n - 1;
  while (first < last && cumulative[first + 1] <= negligible) ++first;
  // From the right, where differences of sums would be rounding, by the weights.
  for (double beyond = 0; last > first; --last) {
    beyond += cumulative[last + 1] - cumulative[last];
    if (beyond > negligible) break;
  }
  const double extent = xi[last] - xi[first];
  const double fewest = extent / static_cast<double>(most);
  const double actual = std::max(width, fewest);
  if (extent > 0 && most > 1) {
    const auto patches = static_cast<std::size_t>(std::clamp(std::ceil(extent / actual), 1.0, 1e9));
    std::size_t at = first;
    for (std::size_t k = 1; k < std::min(patches, most); ++k) {
      const double end = xi[first] + extent * static_cast<double>(k) / static_cast<double>(patches);
      while (at < last && xi[at] < end) ++at;
      if (at > begin.back()) begin.push_back(at);
    }
  }
  begin.push_back(n);
}

void LineRecombination::prepare(std::span<const double> x, std::span<const double> log_weight,
                                LineNodes& out) {
  const std::size_t n = x.size();
  weight_.resize(n);
  relative_weights(log_weight, *std::max_element(log_weight.begin(), log_weight.end()), weight_.data());
  cumulative_.resize(n + 1);
  cumulative_[0] = 0;
  for (std::size_t i = 0; i < n; ++i) cumulative_[i + 1] = cumulative_[i] + weight_[i];
  deviation_ = mean_deviation(x.data(), weight_.data(), n).deviation;
  out.x.clear();
  out.log_weight.clear();
  out.near.clear();
  out.discarded = 0;
}

void LineRecombination::reduce_patches(std::span<const double> x, std::span<const double> log_weight,
                                       std::size_t nodes, LineNodes& out) {
  for (std::size_t k = 0; k + 1 < begin_.size(); ++k) {
    const std::size_t first = begin_[k], size = begin_[k + 1] - first;
    reduce_patch(x.subspan(first, size), log_weight.subspan(first, size), first, nodes, out);
  }
}

void LineRecombination::reduce(std::span<const double> x, std::span<const double> log_weight, int degree,
                               std::size_t budget, LineNodes& out) {
  const LineRule rule = line_rule(degree, budget);
  prepare(x, log_weight, out);
  cut_line(x, cumulative_, rule, begin_);
  reduce_patches(x, log_weight, rule.nodes, out);
}

void LineRecombination::reduce_evenly(std::span<const double> x, std::span<const double> log_weight,
                                      std::span<const double> deviation, double width, int degree,
                                      std::size_t budget, LineNodes& out) {
  prepare(x, log_weight, out);
  // The deviation varies slowly over a gap between points: its mean at the ends is as good as an integral.
  xi_.resize(x.size());
  xi_[0] = 0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    const double between = 0.5 * (deviation[i] + deviation[i - 1]);
    xi_[i] = xi_[i - 1] + (between > 0 ? (x[i] - x[i - 1]) / between : 0);
  }
  const std::size_t nodes = std::min(degree > 0 ? static_cast<std::size_t>(degree) / 2 + 1 : 4, budget);
  cut_evenly(xi_, cumulative_, width, budget / nodes, begin_);
  reduce_patches(x, log_weight, nodes, out);
}

void LineRecombination::reduce_patch(std::span<const double> x, std::span<const double> log_weight,
                                     std::size_t first, std::size_t nodes, LineNodes& out) {
  const std::size_t n = x.size();
  if (n <= nodes) {
    for (std::size_t i = 0; i < n; ++i) {
      out.x.push_back(x[i]);
      out.log_weight.push_back(log_weight[i]);
      out.near.push_back(static_cast<std::uint32_t>(first + i));
    }
    return;
  }
  const double largest = *std::max_element(log_weight.begin(), log_weight.end());
  const double mass = relative_weights(log_weight, largest, weight_.data());
  const double half = x.back() / 2 - x.front() / 2, centre = x.front() + half;
  z_.resize(n);
  for (std::size_t i = 0; i < n; ++i) z_[i] = half > 0 ? std::clamp((x[i] - centre) / half, -1.0, 1.0) : 0.0;
  const std::size_t count = gauss_.compute(z_, std::span<const double>(weight_).first(n), nodes);
  std::size_t near = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const double w = gauss_.weights()[j];
    if (!(w > 0)) continue;
    const double z = gauss_.nodes()[j];
    // Points strictly ascend from node to node: enough of them are left for the nodes that follow.
    while (near + (count - j) < n && std::abs(z_[near + 1] - z) <= std::abs(z_[near] - z)) ++near;
    out.x.push_back(std::clamp(centre + half * z, x.front(), x.back()));
    out.log_weight.push_back(largest + std::log(mass * w));
    out.near.push_back(static_cast<std::uint32_t>(first + near));
    ++near;
  }
  // |f^(2s)| <= 1 per standard deviation: f's integral changes by at most that of z^(2s) / (2s)!.
  if (!(deviation_ > 0)) return;  // all mass, to rounding, lies at one point
  double change = gauss_.first_change() * (cumulative_[first + n] - cumulative_[first]) / cumulative_.back();
  for (std::size_t k = 1; k <= 2 * nodes; ++k) change *= half / (deviation_ * static_cast<double>(k));
  out.discarded += change;
}

}  // namespace wienertree::recombination
