#pragma once
/// The Euler particle filter of one model, written by hand: the limit that the general one is measured
/// against.
#include <cstdint>
#include <vector>

namespace wienertree::bench {

/// dX = mu sigma tanh(mu X/sigma) dt + sigma dB, X_0 = x0, dY = h1 X dt + dW.
struct TanhProblem {
  double mu, sigma, h1, x0;
};

struct HandWrittenResult {
  double mean, log_evidence;
};

/// N particles, one step of length dt for every increment of Y, systematic resampling at every step; Philox
/// and Box-Muller for the noise. Scratch is allocated once.
HandWrittenResult hand_written_euler(const TanhProblem& problem, const std::vector<double>& increments,
                                     double dt, std::size_t N, std::uint64_t seed);

}  // namespace wienertree::bench
