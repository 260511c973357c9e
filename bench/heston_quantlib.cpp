#include <cmath>
#include <ql/exercise.hpp>
#include <ql/instruments/vanillaoption.hpp>
#include <ql/pricingengines/vanilla/mceuropeanhestonengine.hpp>
#include <ql/processes/hestonprocess.hpp>
#include <ql/quotes/simplequote.hpp>
#include <ql/termstructures/yield/flatforward.hpp>
#include <ql/time/calendars/nullcalendar.hpp>
#include <ql/time/daycounters/actual365fixed.hpp>

#include "heston_rivals.hpp"

namespace wienertree::bench {

MonteCarloResult quantlib_heston(const HestonCall& call, std::size_t steps, std::size_t paths,
                                 std::uint64_t seed) {
  using namespace QuantLib;
  const Date today(1, January, 2001);  // a year of 365 days: T is 1 by Actual/365
  Settings::instance().evaluationDate() = today;
  const auto curve = [&](double rate) {
    return Handle<YieldTermStructure>(ext::make_shared<FlatForward>(today, rate, Actual365Fixed()));
  };
  const auto process = ext::make_shared<HestonProcess>(curve(call.r), curve(0),
                                                       Handle<Quote>(ext::make_shared<SimpleQuote>(call.s0)),
                                                       call.v0, call.kappa, call.theta, call.xi, call.rho);
  const auto expiry = static_cast<Integer>(std::lround(365 * call.horizon));
  VanillaOption option(ext::make_shared<PlainVanillaPayoff>(Option::Call, call.strike),
                       ext::make_shared<EuropeanExercise>(today + expiry));
  option.setPricingEngine(
      MakeMCEuropeanHestonEngine<PseudoRandom>(process).withSteps(steps).withSamples(paths).withSeed(
          static_cast<BigNatural>(seed)));
  return {option.NPV(), option.errorEstimate()};
}

}  // namespace wienertree::bench
