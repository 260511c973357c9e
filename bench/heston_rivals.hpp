#pragma once
/// A European call in Heston's model, as others price it.
#include <cstddef>
#include <cstdint>

namespace wienertree::bench {

/// dS = r S dt + sqrt(v) S dB^1, dv = kappa (theta - v) dt + xi sqrt(v) (rho dB^1 + sqrt(1 - rho^2) dB^2).
struct HestonCall {
  double s0 = 100, strike = 105, r = 0.02, v0 = 0.04, kappa = 1.5, theta = 0.05, xi = 0.4, rho = -0.5;
  double horizon = 274.0 / 365;  ///< whole days, for QuantLib's dates
  /// Undiscounted, by Lewis' integral, for the values above.
  static constexpr double exact = 5.2236711962;
};

struct MonteCarloResult {
  double value, standard_error;
};

/// QuantLib's MCEuropeanHestonEngine with Mersenne Twister and inverse cumulative normals, in its default
/// discretisation (quadratic exponential with martingale correction: Andersen 2008).
MonteCarloResult quantlib_heston(const HestonCall& call, std::size_t steps, std::size_t paths,
                                 std::uint64_t seed);

/// The same engine driven by Sobol numbers (LowDiscrepancy). No standard error: 0.
MonteCarloResult quantlib_heston_sobol(const HestonCall& call, std::size_t steps, std::size_t paths);

/// QuantLib's FdHestonVanillaEngine in its default scheme (Hundsdorfer), on a grid of `time` steps, `price` by
/// `variance` points; undiscounted. Standard error 0.
MonteCarloResult quantlib_heston_fd(const HestonCall& call, std::size_t time, std::size_t price,
                                    std::size_t variance);

/// The same engine for the digital that pays 1 above the strike.
MonteCarloResult quantlib_heston_digital_fd(const HestonCall& call, std::size_t time, std::size_t price,
                                            std::size_t variance);

/// QuantLib's MCEuropeanBasketEngine driven by Sobol numbers for `basket_call` of option_problems.hpp: the law of the
/// prices at the horizon is drawn in one step, which is exact for them.
MonteCarloResult quantlib_basket_sobol(std::size_t paths);

}  // namespace wienertree::bench
