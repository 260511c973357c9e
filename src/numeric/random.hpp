#pragma once
/// Counter-based random numbers: Philox4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1,
/// 2, 3"). A draw is a function of (seed, launch, step, purpose, index): no generator state is shared, and
/// the same seed gives the same bytes for any number of threads.
#include <cstdint>
#include <span>

namespace wienertree {

/// What a draw is for: streams of different purposes never meet.
enum class Purpose : std::uint32_t {
  thinning = 1,
  signal_noise,
  observation_noise,
  observation_uniform,
  euler_noise,
  mixture_noise,
  mixture_offspring,
  initial_state,
  path_sampling,
};

struct RandomStream {
  std::uint64_t seed = 0;
  std::uint32_t launch = 0;
  std::uint32_t step = 0;
  Purpose purpose = Purpose::thinning;
  /// Uniform on the 2^52 numbers (k + 1/2) 2^-52, so never 0 nor 1: draw number `index` of this stream.
  /// Many at once cost a tenth: `uniforms`.
  double uniform(std::uint64_t index) const;
  /// Draws first .. first+out.size()-1; below number 2^49 streams of different purposes never meet.
  void uniforms(std::uint64_t first, std::span<double> out) const;
  /// Standard normal draws first .. first+out.size()-1. Box, Muller (1958, Ann. Math. Statist. 29, 610-611):
  /// sqrt(-2 log u) (cos 2 pi v, sin 2 pi v), with (u, v) = uniforms (2i, 2i+1) of the stream.
  void normals(std::uint64_t first, std::span<double> out) const;
  /// Standard exponential draws -log u, u the uniforms first .. first+out.size()-1.
  void exponentials(std::uint64_t first, std::span<double> out) const;
};

}  // namespace wienertree
