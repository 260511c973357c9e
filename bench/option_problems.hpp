#pragma once
/// Averages that several methods compute in weak_error_per_second, with the references they are compared with.
#include <string>
#include <vector>

#include "heston_rivals.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::bench {

struct OptionProblem {
  std::string name;
  TextModel model;
  std::string payoff, kink;  ///< what passes through 0 where the payoff is not smooth
  double horizon, exact;     ///< undiscounted
};

/// P(S_T > K) by inversion of Heston's characteristic function (Gil-Pelaez 1951; in the form of Albrecher, Mayer,
/// Schoutens, Tistaert 2007), by the trapezoidal rule, which converges geometrically here.
double heston_digital(const HestonCall& call);

/// Three lognormal prices from 100, with volatilities 0.2, 0.3, 0.4, rate 0.02 and correlations 0.5 (1, 2), 0.3 (1, 3),
/// 0.4 (2, 3) at time 1: E (mean of the three - 100)^+, Gauss-Legendre in two normal variables over Black and Scholes'
/// formula in the third, 240 points each.
double basket_call();

/// "call", d = 2: that of HestonCall.  "digital", d = 2: in the same model.
/// "Asian", d = 3: Ninomiya and Victoir (2008), Heston's model with the average; by bench/asian-reference, to 2e-7.
/// "basket", d = 3: as above.
std::vector<OptionProblem> option_problems();

}  // namespace wienertree::bench
