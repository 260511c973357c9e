// Compiled with -O3 -march=native -ffast-math: loops over blocks of particles that the compiler turns into
// vector code, with the C library's vector functions.
#include "hand_written_euler.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace wienertree::bench {
namespace {

constexpr std::size_t block = 1024;

// Two normals for each counter first .. first + block/2 - 1 (Philox4x32-10; Box, Muller 1958).
void normals(std::uint64_t seed, std::uint32_t step, std::uint32_t first, double* out) {
  constexpr std::size_t pairs = block / 2;
  std::uint32_t a[pairs], b[pairs], c[pairs], d[pairs];
  double radius[pairs], angle[pairs];
  for (std::uint32_t i = 0; i < pairs; ++i) {
    std::uint32_t r0 = first + i, r1 = step, r2 = 0, r3 = 0;
    auto k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
#pragma GCC unroll 10
    for (int round = 0; round < 10; ++round) {
      const std::uint64_t p0 = std::uint64_t{0xD2511F53} * r0, p1 = std::uint64_t{0xCD9E8D57} * r2;
      const std::uint32_t n0 = static_cast<std::uint32_t>(p1 >> 32) ^ r1 ^ k0;
      const std::uint32_t n2 = static_cast<std::uint32_t>(p0 >> 32) ^ r3 ^ k1;
      r1 = static_cast<std::uint32_t>(p1);
      r3 = static_cast<std::uint32_t>(p0);
      r0 = n0;
      r2 = n2;
      k0 += 0x9E3779B9;
      k1 += 0xBB67AE85;
    }
    a[i] = r0;
    b[i] = r1;
    c[i] = r2;
    d[i] = r3;
  }
  for (std::size_t i = 0; i < pairs; ++i) {
    // 32 + 20 bits in (0, 1)
    const double u = (static_cast<double>(static_cast<std::int32_t>(a[i] >> 1)) +
                      static_cast<double>(static_cast<std::int32_t>(b[i] >> 11)) * 0x1p-21 + 0x1p-22) *
                     0x1p-31;
    const double v = (static_cast<double>(static_cast<std::int32_t>(c[i] >> 1)) +
                      static_cast<double>(static_cast<std::int32_t>(d[i] >> 11)) * 0x1p-21) *
                     0x1p-31;
    radius[i] = std::sqrt(-2 * std::log(u));
    angle[i] = 2 * std::numbers::pi * v;
  }
  // Apart, for there is no vector function of sine and cosine at once.
  for (std::size_t i = 0; i < pairs; ++i) out[i] = radius[i] * std::cos(angle[i]);
  for (std::size_t i = 0; i < pairs; ++i) out[pairs + i] = radius[i] * std::sin(angle[i]);
}

}  // namespace

HandWrittenResult hand_written_euler(const TanhProblem& problem, const std::vector<double>& increments,
                                     double dt, std::size_t N, std::uint64_t seed) {
  const auto [mu, sigma, h1, x0] = problem;
  const std::size_t padded = (N + block - 1) / block * block;
  std::vector<double> x(padded, x0), next(padded + 8), w(padded);
  double noise[block], log_evidence = 0, mean = x0;
  const double drift = mu * sigma * dt, slope = mu / sigma, spread = sigma * std::sqrt(dt);
  for (std::uint32_t step = 0; step < increments.size(); ++step) {
    const double a = h1 * increments[step], b = -h1 * h1 * dt / 2;
    double largest = -INFINITY;
    for (std::size_t i = 0; i < N; ++i) {
      w[i] = x[i] * (a + b * x[i]);
      largest = std::max(largest, w[i]);
    }
    for (std::size_t first = 0; first < N; first += block) {
      normals(seed, step, static_cast<std::uint32_t>(first / 2), noise);
      double* y = x.data() + first;
      for (std::size_t i = 0; i < block; ++i) y[i] += drift * std::tanh(slope * y[i]) + spread * noise[i];
    }
    double total = 0, weighted = 0;
    for (std::size_t i = 0; i < N; ++i) {
      w[i] = std::exp(w[i] - largest);
      total += w[i];
      weighted += w[i] * x[i];
    }
    log_evidence += largest + std::log(total / static_cast<double>(N));
    mean = weighted / total;
    // Systematic: particle i gets the integers below its cumulated weight, shifted by one uniform.
    std::uint64_t mix = (seed + step) * 0x9E3779B97F4A7C15;
    mix = (mix ^ mix >> 30) * 0xBF58476D1CE4E5B9;
    double position = static_cast<double>(mix >> 12) * 0x1p-52;
    const double scale = static_cast<double>(N) / total;
    std::int64_t placed = 0;
    for (std::size_t i = 0; i < N; ++i) {
      position += w[i] * scale;
      const std::int64_t until = std::min(static_cast<std::int64_t>(position), static_cast<std::int64_t>(N));
      double* to = next.data() + placed;
      to[0] = to[1] = x[i];
      for (std::int64_t k = 2; k < until - placed; ++k) to[k] = x[i];
      placed = until;
    }
    for (; placed < static_cast<std::int64_t>(N); ++placed) next[static_cast<std::size_t>(placed)] = x[N - 1];
    x.swap(next);
    x.resize(padded);
    next.resize(padded + 8);
  }
  return {mean, log_evidence};
}

}  // namespace wienertree::bench
