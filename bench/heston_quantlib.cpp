#include <cmath>
#include <ql/exercise.hpp>
#include <ql/instruments/vanillaoption.hpp>
#include <ql/pricingengines/vanilla/fdhestonvanillaengine.hpp>
#include <ql/pricingengines/vanilla/mceuropeanhestonengine.hpp>
#include <ql/processes/hestonprocess.hpp>
#include <ql/quotes/simplequote.hpp>
#include <ql/termstructures/yield/flatforward.hpp>
#include <ql/time/calendars/nullcalendar.hpp>
#include <ql/time/daycounters/actual365fixed.hpp>

#include "heston_rivals.hpp"

namespace wienertree::bench {

namespace {

using namespace QuantLib;

// The option without an engine, and its process.
struct Priced {
  ext::shared_ptr<HestonProcess> process;
  VanillaOption option;
  double discount;
};

Priced priced(const HestonCall& call) {
  const Date today(1, January, 2001);  // a year of 365 days
  Settings::instance().evaluationDate() = today;
  const auto curve = [&](double rate) {
    return Handle<YieldTermStructure>(ext::make_shared<FlatForward>(today, rate, Actual365Fixed()));
  };
  const auto process = ext::make_shared<HestonProcess>(curve(call.r), curve(0),
                                                       Handle<Quote>(ext::make_shared<SimpleQuote>(call.s0)),
                                                       call.v0, call.kappa, call.theta, call.xi, call.rho);
  const auto expiry = static_cast<Integer>(std::lround(365 * call.horizon));
  return {process,
          VanillaOption(ext::make_shared<PlainVanillaPayoff>(Option::Call, call.strike),
                        ext::make_shared<EuropeanExercise>(today + expiry)),
          std::exp(-call.r * static_cast<double>(expiry) / 365)};
}

}  // namespace

MonteCarloResult quantlib_heston(const HestonCall& call, std::size_t steps, std::size_t paths,
                                 std::uint64_t seed) {
  Priced p = priced(call);
  p.option.setPricingEngine(
      MakeMCEuropeanHestonEngine<PseudoRandom>(p.process).withSteps(steps).withSamples(paths).withSeed(
          static_cast<BigNatural>(seed)));
  return {p.option.NPV() / p.discount, p.option.errorEstimate() / p.discount};
}

MonteCarloResult quantlib_heston_sobol(const HestonCall& call, std::size_t steps, std::size_t paths) {
  Priced p = priced(call);
  p.option.setPricingEngine(
      MakeMCEuropeanHestonEngine<LowDiscrepancy>(p.process).withSteps(steps).withSamples(paths).withSeed(1));
  return {p.option.NPV() / p.discount, 0};
}

MonteCarloResult quantlib_heston_fd(const HestonCall& call, std::size_t time, std::size_t price,
                                    std::size_t variance) {
  Priced p = priced(call);
  p.option.setPricingEngine(ext::make_shared<FdHestonVanillaEngine>(
      ext::make_shared<HestonModel>(p.process), time, price, variance, 0, FdmSchemeDesc::Hundsdorfer()));
  return {p.option.NPV() / p.discount, 0};
}

}  // namespace wienertree::bench
