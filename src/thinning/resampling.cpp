#include "wienertree/thinning/resampling.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>

namespace wienertree {
namespace {

constexpr std::size_t buffered = 256;

// Draws of a stream in ascending order, a buffer at a time.
class Uniforms {
 public:
  explicit Uniforms(const RandomStream& random) : random_(random) {}
  /// Draw number `index` >= every index asked for before.
  double operator[](std::uint64_t index) {
    if (index - first_ >= size_) refill(index);
    return u_[index - first_];
  }

 private:
  // Where a whole buffer and more was skipped, the next one would be too.
  void refill(std::uint64_t index) {
    size_ = index - (first_ + size_) < buffered ? buffered : 1;
    first_ = index;
    random_.uniforms(first_, {u_.data(), size_});
  }

  const RandomStream& random_;
  std::uint64_t first_ = 0;
  std::size_t size_ = 0;
  std::array<double, buffered> u_;
};

std::uint64_t sum(std::span<const std::uint64_t> mass) {
  return std::accumulate(mass.begin(), mass.end(), std::uint64_t{0});
}

double sum_of_exponentials(const RandomStream& random, std::uint64_t draws) {
  std::array<double, buffered> e;
  double total = 0;
  for (std::uint64_t first = 0; first < draws; first += buffered) {
    const std::span<double> part{e.data(), std::min<std::uint64_t>(buffered, draws - first)};
    random.exponentials(first, part);
    total += std::accumulate(part.begin(), part.end(), 0.0);
  }
  return total;
}

// Adds to `count` the multinomial counts of n points on sites of mass (mass_i & mask), which sum to `total`.
//
// With E_0..E_n standard exponential and S_k = E_0 + .. + E_k, the S_k / S_n for k < n are n uniforms in
// ascending order.
void add_multinomial(std::span<const std::uint64_t> mass, std::uint64_t mask, std::uint64_t total,
                     std::uint64_t n, const RandomStream& random, std::span<std::uint32_t> count) {
  if (n == 0) return;
  // Summed in another order than below, S_n may be missed by rounding: the last points are held inside.
  const double scale = static_cast<double>(total) / sum_of_exponentials(random, n + 1);
  std::array<double, buffered> e;
  double s = 0;
  std::size_t site = 0;
  std::uint64_t above = mass[0] & mask;  // points below it lie in sites 0..site
  for (std::uint64_t first = 0; first < n; first += buffered) {
    const std::size_t drawn = std::min<std::uint64_t>(buffered, n - first);
    random.exponentials(first, {e.data(), drawn});
    for (std::size_t k = 0; k < drawn; ++k) {
      s += e[k];
      const auto point = std::min(static_cast<std::uint64_t>(s * scale), total - 1);
      while (above <= point) above += mass[++site] & mask;
      ++count[site];
    }
  }
}

}  // namespace

void systematic_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                       std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  std::uint64_t position = static_cast<std::uint64_t>(std::ldexp(random.uniform(0), fraction_bits));
  for (std::size_t i = 0; i < mass.size(); ++i) {
    const std::uint64_t next = position + mass[i];
    count[i] = static_cast<std::uint32_t>((next >> fraction_bits) - (position >> fraction_bits));
    position = next;
  }
}

void stratified_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                       std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  const std::uint64_t fraction = (std::uint64_t{1} << fraction_bits) - 1;
  const double one = std::ldexp(1.0, fraction_bits);
  Uniforms u(random);
  std::uint64_t position = 0, points = 0;  // points below the position
  for (std::size_t i = 0; i < mass.size(); ++i) {
    position += mass[i];
    const std::uint64_t stratum = position >> fraction_bits;
    const bool passed =
        u[stratum] * one < static_cast<double>(static_cast<std::int64_t>(position & fraction));
    const std::uint64_t next = stratum + (passed ? 1 : 0);
    count[i] = static_cast<std::uint32_t>(next - points);
    points = next;
  }
}

void multinomial_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                        std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  const std::uint64_t total = sum(mass);
  std::fill(count.begin(), count.end(), 0);
  add_multinomial(mass, ~std::uint64_t{0}, total, total >> fraction_bits, random, count);
}

void residual_counts(std::span<const std::uint64_t> mass, int fraction_bits, const RandomStream& random,
                     std::span<std::uint32_t> count) {
  assert(count.size() == mass.size());
  const std::uint64_t fraction = (std::uint64_t{1} << fraction_bits) - 1;
  std::uint64_t residual = sum(mass);
  for (std::size_t i = 0; i < mass.size(); ++i) {
    const std::uint64_t whole = mass[i] >> fraction_bits;
    count[i] = static_cast<std::uint32_t>(whole);
    residual -= whole << fraction_bits;
  }
  add_multinomial(mass, fraction, residual, residual >> fraction_bits, random, count);
}

}  // namespace wienertree
