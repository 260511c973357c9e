#include "wienertree/thinning/masses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>

#include "wienertree/numeric/clones.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/log_weights.hpp"

namespace wienertree {
namespace {

/// Sites summed plainly before the compensated sum takes over.
constexpr std::size_t chunk = ParticleMasses::chunk;
constexpr std::size_t block = 128 * chunk;

// Neumaier (1974, Z. angew. Math. Mech. 54, 39-51).
class CompensatedSum {
 public:
  void add(double x) {
    const double next = sum_ + x;
    error_ += std::abs(sum_) >= std::abs(x) ? (sum_ - next) + x : (x - next) + sum_;
    sum_ = next;
  }
  double value() const { return sum_ + error_; }

 private:
  double sum_ = 0, error_ = 0;
};

// From weights, as bits, to masses: rounded to nearest, and their sum.
WIENERTREE_CLONES std::uint64_t scale_masses(std::uint64_t* mass, std::size_t n, double scale) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    mass[i] =
        static_cast<std::uint64_t>(static_cast<std::int64_t>(std::bit_cast<double>(mass[i]) * scale + 0.5));
    sum += mass[i];
  }
  return sum;
}

[[noreturn]] void refuse(std::span<const double> log_weight) {
  const std::string sites = fmt::format("{} sites", log_weight.size());
  for (std::size_t i = 0; i < log_weight.size(); ++i)
    if (!(log_weight[i] <= std::numeric_limits<double>::max()))
      throw RunError(
          fmt::format("the log-weight of site {} of {} is not a number below infinity", i, log_weight.size()),
          "thinning", fmt::format("{}", log_weight[i]));
  throw RunError("no site has a positive weight", "thinning", sites);
}

}  // namespace

void assign_masses(std::span<const double> log_weight, std::uint64_t particles, ParticleMasses& out,
                   ThreadPool* threads) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::size_t n = log_weight.size();
  if (particles < 1 || particles > largest_particle_number)
    throw InputError(fmt::format("the number of particles must lie in 1..{}", largest_particle_number),
                     "thinning", fmt::format("{}", particles));
  if (n > std::numeric_limits<std::uint32_t>::max())
    throw InputError("too many sites for 32-bit indices", "thinning", fmt::format("{}", n));
  std::vector<double>& scratch = out.scratch;
  scratch.assign((n + block - 1) / block, -infinity);
  std::atomic<bool> all_positive = true;
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t b) {
    const LargestLogWeight here = largest_log_weight(log_weight.subspan(first, count));
    scratch[b] = here.all_valid ? here.value : infinity;
    if (!here.all_positive) all_positive = false;
  });
  out.all_positive = all_positive;
  const auto heaviest_block = std::max_element(scratch.begin(), scratch.end());
  const auto heaviest_from =
      log_weight.begin() + static_cast<std::ptrdiff_t>(block) * (heaviest_block - scratch.begin());
  const double largest = n > 0 ? *heaviest_block : -infinity;
  if (!std::isfinite(largest)) refuse(log_weight);

  resize_unspecified(out.mass, n);
  scratch.resize((n + chunk - 1) / chunk);
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t) {
    std::array<double, chunk> w;
    for (std::size_t i = first; i < first + count; i += chunk) {
      const std::size_t some = std::min(chunk, first + count - i);
      scratch[i / chunk] = relative_weights(log_weight.subspan(i, some), largest, w.data());
      std::memcpy(out.mass.data() + i, w.data(), some * sizeof(double));  // as bits, until scaled
    }
  });
  CompensatedSum sum;
  for (const double s : scratch) sum.add(s);
  const double total = sum.value();
  out.particles = particles;
  out.fraction_bits = 63 - static_cast<int>(std::bit_width(particles));
  out.log_total = largest + std::log(total);

  // w_i <= 1 <= total, so a product is at most N 2^B < 2^63 up to rounding.
  const double scale = std::ldexp(static_cast<double>(particles), out.fraction_bits) / total;
  std::atomic<std::uint64_t> assigned = 0;
  out.chunk_mass.resize(scratch.size());
  for_blocks(threads, n, block, [&](std::size_t first, std::size_t count, std::size_t) {
    std::uint64_t here = 0;
    for (std::size_t i = first; i < first + count; i += chunk) {
      out.chunk_mass[i / chunk] =
          scale_masses(out.mass.data() + i, std::min(chunk, first + count - i), scale);
      here += out.chunk_mass[i / chunk];
    }
    assigned += here;
  });
  const auto heaviest =
      static_cast<std::size_t>(std::find(heaviest_from, log_weight.end(), largest) - log_weight.begin());
  const std::uint64_t missing = (particles << out.fraction_bits) - assigned;  // modulo 2^64: may subtract
  out.mass[heaviest] += missing;
  out.chunk_mass[heaviest / chunk] += missing;
}

void split_mass(std::uint64_t mass, std::span<const double> lambda, std::span<std::uint64_t> children) {
  assert(lambda.size() == children.size() && !lambda.empty() && mass < std::uint64_t{1} << 63);
  std::uint64_t assigned = 0;
  for (std::size_t j = 0; j < lambda.size(); ++j) {
    children[j] = static_cast<std::uint64_t>(static_cast<double>(mass) * lambda[j]);
    assigned += children[j];
  }
  const auto largest =
      static_cast<std::size_t>(std::max_element(lambda.begin(), lambda.end()) - lambda.begin());
  children[largest] += mass - assigned;  // modulo 2^64: may subtract
}

}  // namespace wienertree
