#pragma once
/// Monte Carlo for a European call in Heston's model, as others do it.
#include <cstddef>
#include <cstdint>

namespace wienertree::bench {

/// dS = r S dt + sqrt(v) S dB^1, dv = kappa (theta - v) dt + xi sqrt(v) (rho dB^1 + sqrt(1 - rho^2) dB^2).
struct HestonCall {
  double s0 = 100, strike = 100, r = 0, v0 = 0.04, kappa = 2, theta = 0.04, xi = 0.3, rho = -0.7, horizon = 1;
  /// By Fourier inversion, for the values above.
  static constexpr double exact = 7.6157469179;
};

struct MonteCarloResult {
  double value, standard_error;
};

/// QuantLib's MCEuropeanHestonEngine with Mersenne Twister and inverse cumulative normals, in its default
/// discretisation (quadratic exponential with martingale correction: Andersen 2008).
MonteCarloResult quantlib_heston(const HestonCall& call, std::size_t steps, std::size_t paths,
                                 std::uint64_t seed);

}  // namespace wienertree::bench
