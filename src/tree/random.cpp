#include "wienertree/tree/random.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

namespace wienertree {
namespace {

struct UniformPair {
  double first, second;
};

// Counter (index, step, launch with the purpose in its high byte): 2^32 x 2 indices per block number would
// wrap at 2^33 draws a stream, so the pair number takes 64 bits of the counter.
UniformPair uniform_pair(const RandomStream& s, std::uint64_t pair) {
  using Generator = r123::Philox4x32;
  const Generator::ctr_type counter = {
      {static_cast<std::uint32_t>(pair),
       static_cast<std::uint32_t>(pair >> 32) ^ (static_cast<std::uint32_t>(s.purpose) << 16), s.step,
       s.launch}};
  const Generator::key_type key = {
      {static_cast<std::uint32_t>(s.seed), static_cast<std::uint32_t>(s.seed >> 32)}};
  const Generator::ctr_type r = Generator()(counter, key);
  const auto to_unit = [](std::uint32_t high, std::uint32_t low) {
    const std::uint64_t bits = (static_cast<std::uint64_t>(high) << 32 | low) >> 11;
    return (static_cast<double>(bits) + 0.5) * 0x1.0p-53;
  };
  return {to_unit(r[0], r[1]), to_unit(r[2], r[3])};
}

struct NormalPair {
  double first, second;
};

NormalPair normal_pair(const RandomStream& s, std::uint64_t pair) {
  const auto [u, v] = uniform_pair(s, pair);
  const double radius = std::sqrt(-2.0 * std::log(u));
  const double angle = 2.0 * std::numbers::pi * v;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

template <class Pair>
void fill(std::uint64_t first, std::span<double> out, Pair pair_of) {
  std::size_t i = 0;
  if (!out.empty() && first % 2 == 1) out[i++] = pair_of(first / 2).second;
  for (; i + 1 < out.size(); i += 2) {
    const auto p = pair_of((first + i) / 2);
    out[i] = p.first;
    out[i + 1] = p.second;
  }
  if (i < out.size()) out[i] = pair_of((first + i) / 2).first;
}

}  // namespace

double RandomStream::uniform(std::uint64_t index) const {
  const auto p = uniform_pair(*this, index / 2);
  return index % 2 == 0 ? p.first : p.second;
}

void RandomStream::uniforms(std::uint64_t first, std::span<double> out) const {
  fill(first, out, [&](std::uint64_t pair) { return uniform_pair(*this, pair); });
}

void RandomStream::normals(std::uint64_t first, std::span<double> out) const {
  fill(first, out, [&](std::uint64_t pair) { return normal_pair(*this, pair); });
}

}  // namespace wienertree
