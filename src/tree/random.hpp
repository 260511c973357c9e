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
  /// Uniform on the open interval (0,1), 53 bits: draw number `index` of this stream.
  double uniform(std::uint64_t index) const;
  /// Draws first .. first+out.size()-1.
  void uniforms(std::uint64_t first, std::span<double> out) const;
  /// Standard normal draws (Box-Muller on pairs of uniforms): draws first .. first+out.size()-1.
  void normals(std::uint64_t first, std::span<double> out) const;
};

}  // namespace wienertree
