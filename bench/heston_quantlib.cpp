#include <cmath>
#include <ql/exercise.hpp>
#include <ql/instruments/basketoption.hpp>
#include <ql/instruments/vanillaoption.hpp>
#include <ql/pricingengines/basket/mceuropeanbasketengine.hpp>
#include <ql/pricingengines/vanilla/fdhestonvanillaengine.hpp>
#include <ql/pricingengines/vanilla/mceuropeanhestonengine.hpp>
#include <ql/processes/blackscholesprocess.hpp>
#include <ql/processes/hestonprocess.hpp>
#include <ql/processes/stochasticprocessarray.hpp>
#include <ql/quotes/simplequote.hpp>
#include <ql/termstructures/volatility/equityfx/blackconstantvol.hpp>
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

const Date today(1, January, 2001);  // a year of 365 days

Handle<YieldTermStructure> curve(double rate) {
  return Handle<YieldTermStructure>(ext::make_shared<FlatForward>(today, rate, Actual365Fixed()));
}

Priced priced(const HestonCall& call, const ext::shared_ptr<StrikedTypePayoff>& payoff) {
  Settings::instance().evaluationDate() = today;
  const auto process = ext::make_shared<HestonProcess>(curve(call.r), curve(0),
                                                       Handle<Quote>(ext::make_shared<SimpleQuote>(call.s0)),
                                                       call.v0, call.kappa, call.theta, call.xi, call.rho);
  const auto expiry = static_cast<Integer>(std::lround(365 * call.horizon));
  return {process, VanillaOption(payoff, ext::make_shared<EuropeanExercise>(today + expiry)),
          std::exp(-call.r * static_cast<double>(expiry) / 365)};
}

Priced priced(const HestonCall& call) {
  return priced(call, ext::make_shared<PlainVanillaPayoff>(Option::Call, call.strike));
}

double by_differences(Priced p, std::size_t time, std::size_t price, std::size_t variance) {
  p.option.setPricingEngine(ext::make_shared<FdHestonVanillaEngine>(
      ext::make_shared<HestonModel>(p.process), time, price, variance, 0, FdmSchemeDesc::Hundsdorfer()));
  return p.option.NPV() / p.discount;
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
  return {by_differences(priced(call), time, price, variance), 0};
}

MonteCarloResult quantlib_heston_digital_fd(const HestonCall& call, std::size_t time, std::size_t price,
                                            std::size_t variance) {
  const auto payoff = ext::make_shared<CashOrNothingPayoff>(Option::Call, call.strike, 1.0);
  return {by_differences(priced(call, payoff), time, price, variance), 0};
}

MonteCarloResult quantlib_basket_sobol(std::size_t paths) {
  Settings::instance().evaluationDate() = today;
  std::vector<ext::shared_ptr<StochasticProcess1D>> prices;
  for (const double sigma : {0.2, 0.3, 0.4})
    prices.push_back(ext::make_shared<BlackScholesMertonProcess>(
        Handle<Quote>(ext::make_shared<SimpleQuote>(100.0)), curve(0), curve(0.02),
        Handle<BlackVolTermStructure>(
            ext::make_shared<BlackConstantVol>(today, NullCalendar(), sigma, Actual365Fixed()))));
  Matrix correlation(3, 3, 1.0);
  correlation[0][1] = correlation[1][0] = 0.5;
  correlation[0][2] = correlation[2][0] = 0.3;
  correlation[1][2] = correlation[2][1] = 0.4;
  const auto process = ext::make_shared<StochasticProcessArray>(prices, correlation);
  BasketOption option(
      ext::make_shared<AverageBasketPayoff>(ext::make_shared<PlainVanillaPayoff>(Option::Call, 100.0), 3),
      ext::make_shared<EuropeanExercise>(today + 365));
  option.setPricingEngine(
      MakeMCEuropeanBasketEngine<LowDiscrepancy>(process).withSteps(1).withSamples(paths).withSeed(1));
  return {option.NPV() * std::exp(0.02), 0};
}

}  // namespace wienertree::bench
