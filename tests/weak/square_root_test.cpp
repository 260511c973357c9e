// Square-root processes found in models, moved by their exact transition, with prices integrated out.
#include <fmt/format.h>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "wienertree/model/text_model.hpp"
#include "wienertree/tree/growth.hpp"
#include "wienertree/tree/initial.hpp"
#include "wienertree/tree/square_root_transition.hpp"
#include "wienertree/weak/affine_pieces.hpp"
#include "wienertree/weak/conditional_price.hpp"
#include "wienertree/weak/given_variances.hpp"

using namespace wienertree;

namespace {

TextModel model_of(const std::string& states, const std::string& drift, const std::string& diffusion) {
  return TextModel::parse("convention = \"ito\"\n[parameters]\nrho = -0.5\n[state]\n" + states +
                              "\n[drift]\n" + drift + "\n[diffusion]\n" + diffusion + "\n",
                          "model.toml");
}

const std::string heston_states = "s = { initial = 100 }\nv = { initial = 0.04, lower = 0 }";
const std::string heston_drift = "s = \"0.02*s\"\nv = \"1.5*(0.05 - v)\"";

TextModel heston() {
  return model_of(heston_states, heston_drift,
                  "s = [\"sqrt(v)*s\", 0]\nv = [\"rho*0.4*sqrt(v)\", \"0.4*sqrt((1 - rho^2)*v)\"]");
}

// The leaves of a tree with n steps, thinned to N nodes by recombination.
// A discounting state becomes part of the weights after each step.
Generation leaves(const TextModel& model, int degree, double T, std::size_t n, std::size_t N,
                  std::optional<std::size_t> discount = {}) {
  SquareRootStructure structure = *model.square_roots();
  structure.nonnegative_integrals = !discount;
  const SquareRootTransition transition(structure);
  const auto thinning = make_thinning({ThinningMethod::recombination, SiteOrder::spatial, 0});
  Generation nodes = first_generation(model.model(), N), children;
  Selection selection;
  for (std::size_t j = 1; j <= n; ++j) {
    transition.grow(nodes, degree, T / static_cast<double>(n), nullptr, children);
    for (std::size_t k = 0; discount && k < children.size(); ++k)
      children.log_weight[k] -= std::exchange(children.states(*discount, k), 0.0);
    if (j == n || children.size() <= N) {
      std::swap(nodes, children);
      continue;
    }
    thinning->thin({children.states, children.log_weight, nodes.size(), nullptr}, N,
                   RandomStream{1, 0, static_cast<std::uint32_t>(j), Purpose::path_sampling}, selection);
    select(children, selection, nodes, nullptr);
  }
  return nodes;
}

double average(const BatchFunction& f, const Generation& nodes) {
  std::vector<double> values(nodes.size());
  f(nodes.states, values);
  double sum = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n) sum += std::exp(nodes.log_weight[n]) * values[n];
  return sum;
}

double european(const TextModel& model, const std::string& payoff, const std::string& kink, double T,
                int degree, std::size_t n, std::size_t N) {
  const ConditionalPrice price(*model.square_roots(), model.model().initial);
  std::vector<BatchFunction> kinks;
  if (!kink.empty()) kinks.push_back(model.compile(kink, "kink"));
  return average(price.average(model.compile(payoff, "payoff"), kinks, T),
                 leaves(model.without_price(), degree, T, n, N));
}

}  // namespace

TEST_CASE("payoffs that are affine between kinks are averaged in closed form as by quadrature") {
  const TextModel model = heston();
  const ConditionalPrice price(*model.square_roots(), model.model().initial);
  Batch nodes(2, 3);
  const double variances[] = {0.01, 0.05, 0.4}, integrals[] = {0.0003, 0.03, 2};
  for (std::size_t n = 0; n < 3; ++n) nodes(0, n) = variances[n], nodes(1, n) = integrals[n];
  for (const char* payoff :
       {"max(s - 105, 0)", "max(95 - s, 0)", "s > 100", "if(s > 100, if(s < 120, 2*s, 3), 1)", "abs(s - 100)",
        "max(s-90,0) - 2*max(s-100,0) + max(s-110,0)", "3 - s", "max(s - 100, 0) - s"}) {
    INFO(payoff);
    const KinkedFunction f = model.compile_kinked(payoff, "payoff");
    const auto pieces = affine_pieces(f, model.model().initial, 0, false);
    REQUIRE(pieces.has_value());
    std::array<double, 3> quadrature, rest;
    price.average(f.exact, f.kinks, 0.75)(nodes, quadrature);
    price.average_of_rest(f, 0.75)(nodes, rest);
    const GivenVariances law_of(*model.square_roots(), model.model().initial, 0.75);
    const double slope = pieces->pieces.back().slope, forward = *price.forward(0.75);
    for (std::size_t n = 0; n < 3; ++n) {
      const NormalLaw law = law_of(nodes, n);
      // The quadrature is good to 1e-13 of the forward, about 100, on each of some ten panels.
      CHECK(pieces->average(law.mean, law.deviation) == Approx(quadrature[n]).epsilon(0).margin(1e-10));
      // What grows with the price is known: a call is averaged by its put.
      const double own = std::exp(law.mean + law.deviation * law.deviation / 2);
      CHECK(rest[n] == Approx(quadrature[n] + slope * (forward - own)).epsilon(0).margin(2e-10));
    }
  }
  for (const char* payoff :
       {"max(s - 100, 0)^2", "max(s*v - 100, 0)", "sqrt(max(s, 1))", "v*s", "max(log(s), 0)"})
    CHECK_FALSE(affine_pieces(model.compile_kinked(payoff, "payoff"), model.model().initial, 0, false));
  // States that start from 0, as integrals do, are looked at elsewhere.
  const TextModel longer = model.with_integrals({{"total", "v", "--integral"}});
  for (const char* payoff : {"total", "max(s - 100, 0) + total", "if(total > 0.005, s, 0)"})
    CHECK_FALSE(affine_pieces(longer.compile_kinked(payoff, "payoff"), longer.model().initial, 0, false));
}

TEST_CASE("Heston's model is recognised however it is written") {
  const std::vector<std::pair<std::string, std::string>> same{
      {heston_drift, "s = [\"sqrt(v)*s\", 0]\nv = [\"rho*0.4*sqrt(v)\", \"0.4*sqrt((1 - rho^2)*v)\"]"},
      {heston_drift, "s = [\"s*sqrt((1 - rho^2)*v)\", \"rho*s*v^0.5\"]\nv = [0, \"sqrt(0.16*v)\"]"},
      {"s = \"s*(0.02 + v - v)\"\nv = \"0.075 - 1.5*v\"",
       "s = [\"sqrt(v)*s\", 0]\nv = [\"rho*sqrt(v)*0.4\", \"0.4*sqrt(1 - rho^2)*sqrt(v)\"]"}};
  for (const auto& [drift, diffusion] : same) {
    INFO(diffusion);
    const TextModel model = model_of(heston_states, drift, diffusion);
    REQUIRE(model.square_roots());
    const auto& components = model.square_roots()->components;
    const auto& price = model.square_roots()->price;
    REQUIRE(components.size() == 1);
    CHECK(components[0].state == 1);
    CHECK(components[0].process.a == Approx(0.075).epsilon(1e-14));
    CHECK(components[0].process.b == -1.5);
    CHECK(components[0].process.c == Approx(0.16).epsilon(1e-14));
    REQUIRE(price);
    CHECK(price->rate == 0.02);
    CHECK(price->correlated[0] == Approx(-0.5).epsilon(1e-14));
    CHECK(price->independent[0] == Approx(0.75).epsilon(1e-14));
    CHECK(price->drift[0] == Approx(-0.5).epsilon(1e-14));
  }
  const ModelAnalysis shown = heston().analysis();
  REQUIRE(shown.square_roots.size() == 2);
  CHECK(shown.square_roots[0] ==
        "v: dv = (0.075 - 1.5 v) dt + sqrt(0.16 v) dB, 1.88 degrees of freedom, reaches 0");
  CHECK(shown.square_roots[1] == "s is lognormal given these");
}

TEST_CASE("what else is recognised, and what is not") {
  // Of a logarithm, with a shifted root, with an integral, and two variances.
  const TextModel shifted = model_of("v = { initial = 0.1 }\nI = { initial = 0 }",
                                     "v = \"1 - v\"\nI = \"2*v + 1\"", "v = [\"sqrt(1 + 2*v)\"]\nI = [0]");
  REQUIRE(shifted.square_roots());
  CHECK(shifted.square_roots()->components[0].shift == 0.5);
  CHECK(shifted.square_roots()->components[0].process.a == 1.5);
  CHECK(shifted.square_roots()->components[0].process.c == Approx(2).epsilon(1e-14));
  CHECK(shifted.square_roots()->integrals[0].constant == 0);  // 2 v + 1 = 2 w
  const TextModel two = model_of("x = { initial = 0 }\nv = { initial = 0.1 }\nu = { initial = 0.2 }",
                                 "x = \"-v/2 - u/2\"\nv = \"1 - v\"\nu = \"1 - 2*u\"",
                                 "x = [\"rho*sqrt(v)\", \"sqrt((1 - rho^2)*v)\", \"0.3*sqrt(u)\", "
                                 "\"sqrt(0.91*u)\"]\nv = [\"sqrt(v)\", 0, 0, 0]\n"
                                 "u = [0, 0, \"sqrt(u)\", 0]");
  REQUIRE(two.square_roots());
  REQUIRE(two.square_roots()->price);
  CHECK(two.square_roots()->price->logarithmic);
  CHECK(two.square_roots()->price->independent[1] == Approx(0.91));
  const std::vector<std::tuple<std::string, std::string, std::string, std::string>> others{
      {"v = { initial = 1 }", "v = \"-v^3\"", "v = [\"sqrt(v)\"]", "no state is a square-root process"},
      {"v = { initial = 1 }", "v = \"-v\"", "v = [\"v\"]", "no state is a square-root process"},
      {"v = { initial = 1 }", "v = \"-0.1 - v\"", "v = [\"sqrt(v)\"]", "no state is a square-root process"},
      {"v = { initial = 1 }", "v = \"cos(t) - v\"", "v = [\"sqrt(v)\"]",
       "a coefficient depends on the time t"},
      {"v = { initial = 1 }\nx = { initial = 0 }", "v = \"-v\"\nx = \"-x\"", "v = [\"sqrt(v)\"]\nx = [0]",
       "the drift of x is not affine in the square-root processes"},
      {"v = { initial = 1 }\nx = { initial = 0 }", "v = \"-v\"\nx = \"0\"", "v = [\"sqrt(v)\"]\nx = [\"v\"]",
       "x is neither a square-root process nor a price whose volatility is one's root"},
      {"v = { initial = 1 }\nu = { initial = 1 }", "v = \"-v\"\nu = \"-u\"",
       "v = [\"sqrt(v)\", 0]\nu = [\"sqrt(u)\", \"sqrt(u)\"]",
       "square-root processes are driven by correlated Brownian motions"}};
  for (const auto& [states, drift, diffusion, reason] : others) {
    const TextModel model = model_of(states, drift, diffusion);
    CHECK_FALSE(model.square_roots());
    CHECK(model.analysis().square_roots_reason == reason);
  }
}

TEST_CASE("calls and digitals in Heston's model, whether or not the variance reaches 0") {
  // Lewis' integral of the characteristic function; 4 kappa theta/xi^2 = 1.9.
  const TextModel model = heston();
  CHECK(european(model, "max(s - 105, 0)", "s - 105", 0.75, 5, 32, 2000) ==
        Approx(5.2197880099).margin(1e-4));
  // Four nodes leave 4e-6 of it with 16 steps.
  CHECK(european(model, "max(s - 105, 0)", "s - 105", 0.75, 7, 16, 2000) ==
        Approx(5.2197880099).margin(1e-5));
  const double forward = 100 * std::exp(0.02 * 0.75);
  CHECK(european(model, "s", "", 0.75, 7, 16, 2000) == Approx(forward).epsilon(1e-7));
  // Put-call parity holds leaf by leaf, up to the quadrature.
  const double parity = european(model, "max(s - 105, 0)", "s - 105", 0.75, 5, 8, 500) -
                        european(model, "max(105 - s, 0)", "s - 105", 0.75, 5, 8, 500);
  CHECK(parity == Approx(european(model, "s - 105", "", 0.75, 5, 8, 500)).margin(1e-11));
  const double digital = european(model, "s > 105", "s - 105", 0.75, 5, 16, 1000);
  CHECK(digital + european(model, "s <= 105", "s - 105", 0.75, 5, 16, 2000) == Approx(1).margin(1e-12));
  // Broadie and Kaya (2006), Oper. Res. 54, table 1: 6.8061, 4 kappa theta/xi^2 = 1.27.
  const TextModel published =
      model_of("s = { initial = 100 }\nv = { initial = 0.010201, lower = 0 }",
               "s = \"0.0319*s\"\nv = \"6.21*(0.019 - v)\"",
               "s = [\"sqrt(v)*s\", 0]\nv = [\"-0.7*0.61*sqrt(v)\", \"0.61*sqrt((1 - 0.7^2)*v)\"]");
  CHECK(std::exp(-0.0319) * european(published, "max(s - 100, 0)", "s - 100", 1, 5, 32, 1000) ==
        Approx(6.8061).epsilon(2e-4));
}

TEST_CASE("the sets of Heston's model that Andersen (2008) and Broadie and Kaya (2006) published") {
  struct Set {
    double kappa, theta, xi, rho, start, rate, T, exact;
    std::size_t steps;
  };
  // S_0 = K = 100; exact, without discount, by Lewis' integral. The errors in the steps below are under 4e-4.
  const std::vector<Set> sets{{0.5, 0.04, 1, -0.9, 0.04, 0, 10, 13.08467014, 64},
                              {0.3, 0.04, 0.9, -0.5, 0.04, 0, 15, 16.64922292, 64},
                              {1, 0.09, 1, -0.3, 0.09, 0, 5, 21.79528774, 32},
                              {6.21, 0.019, 0.61, -0.7, 0.010201, 0.0319, 1, 7.026728431, 16},
                              {2, 0.09, 1, -0.3, 0.09, 0.05, 5, 44.9405793, 32}};
  for (const Set& set : sets) {
    INFO("kappa " << set.kappa << ", T " << set.T);
    const auto text = [](double number) { return fmt::format("{}", number); };
    const TextModel model = model_of(
        "s = { initial = 100 }\nv = { initial = " + text(set.start) + ", lower = 0 }",
        "s = \"" + text(set.rate) + "*s\"\nv = \"" + text(set.kappa) + "*(" + text(set.theta) + " - v)\"",
        "s = [\"sqrt(v)*s\", 0]\nv = [\"" + text(set.rho * set.xi) + "*sqrt(v)\", \"" +
            text(set.xi * std::sqrt(1 - set.rho * set.rho)) + "*sqrt(v)\"]");
    CHECK(european(model, "max(s - 100, 0)", "s - 100", set.T, 7, set.steps, 1000) ==
          Approx(set.exact).epsilon(4e-4));
  }
}

TEST_CASE("a call whose value rests on rare paths is that of its put and the forward") {
  // rho xi > kappa: under the measure of the price the variance has no mean to return to.
  const TextModel model = model_of("s = { initial = 100 }\nv = { initial = 0.125, lower = 0 }",
                                   "s = \"0.02*s\"\nv = \"0.3*(0.25 - v)\"",
                                   "s = [\"sqrt(v)*s\", 0]\nv = [\"0.5*sqrt(v)\", \"sqrt(0.75*v)\"]");
  const ConditionalPrice price(*model.square_roots(), model.model().initial);
  const double T = 10, forward = 100 * std::exp(0.2);
  REQUIRE(price.forward(T));
  CHECK(*price.forward(T) == Approx(forward).epsilon(1e-14));
  const auto compiled = [&](const std::string& text) { return model.compile(text, "payoff"); };
  CHECK(price.slope(compiled("max(s - 100, 0)"), T) == Approx(1).epsilon(1e-6));
  CHECK(price.slope(compiled("max(s - 100, 0) - 3*max(s - 200, 0)"), T) == Approx(-2).epsilon(1e-6));
  CHECK(price.slope(compiled("max(100 - s, 0)"), T) == Approx(0).margin(1e-6));
  CHECK(price.slope(compiled("s > 100"), T) == Approx(0).margin(1e-6));
  CHECK(price.slope(compiled("s^2"), T) == 0);
  // The strike of the forward 100 e^{0.2} makes both equal, and every leaf has the forward exactly.
  const std::vector<BatchFunction> kinks{compiled("s - 11482.6*exp(0.2)")};
  const Generation nodes = leaves(model.without_price(), 7, T, 32, 600);
  // Lewis' integral, for the forward 100: 22.772030664.
  CHECK(average(price.average_of_rest(compiled("max(s - 11482.6*exp(0.2), 0)"), kinks, T), nodes) ==
        Approx(22.772030664 * std::exp(0.2)).epsilon(1e-2));
}

TEST_CASE("a bond in the model of Cox, Ingersoll and Ross, 4 a/c = 0.16") {
  const TextModel rate = model_of("v = { initial = 0.1 }", "v = \"0.1*(0.1 - v)\"", "v = [\"0.5*sqrt(v)\"]")
                             .with_integrals({{"I", "v", "test"}});
  // exp(A - B x), gamma = sqrt(kappa^2 + 2 xi^2)
  const double k = 0.1, xi = 0.5, T = 5, gamma = std::sqrt(k * k + 2 * xi * xi), e = std::expm1(gamma * T),
               d = (gamma + k) * e + 2 * gamma;
  const double exact = std::pow(2 * gamma * std::exp((k + gamma) * T / 2) / d, 2 * k * 0.1 / (xi * xi)) *
                       std::exp(-2 * e / d * 0.1);
  CHECK(exact == Approx(0.731012).margin(5e-7));
  // The error of four nodes falls like n^-3 (-1.3e-5, 3e-7 and below at 8, 16, 32 steps), that of three like n^-2.
  const BatchFunction one = rate.compile("1", "one");
  CHECK(average(one, leaves(rate, 7, T, 16, 300, 1)) == Approx(exact).margin(5e-7));
  CHECK(average(one, leaves(rate, 7, T, 8, 300, 1)) == Approx(exact).margin(3e-5));
  CHECK(average(one, leaves(rate, 5, T, 16, 300, 1)) == Approx(exact).margin(1e-4));
}
