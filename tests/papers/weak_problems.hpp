#pragma once
/// Averages whose values are known, and what `wienertree weak --tolerance` does for them.
#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/weak/control.hpp"
#include "wienertree/weak/smoothing.hpp"

namespace wienertree_test {

inline const std::string data = WIENERTREE_SOURCE_DIR "/data/";
inline const std::filesystem::path formulas = data + "cubature_formulas";

inline wienertree::TextModel bundled(const std::string& name) {
  return wienertree::TextModel::load(data + "models/" + name + ".toml", {});
}

/// Heston's parameters, with rho = -0.7 and s = K = 1.
struct HestonParameters {
  double kappa, theta, xi, v0, r;
};
inline constexpr HestonParameters heston_b = {2, 0.04, 0.3, 0.04, 0},
                                  heston_c = {6.21, 0.019, 0.61, 0.010201, 0.0319};

/// In the variance v, which stays where it is at 0.
inline wienertree::TextModel heston(const HestonParameters& a) {
  return wienertree::TextModel::parse(
      fmt::format("name = \"heston\"\nconvention = \"ito\"\n[state]\ns = {{ initial = 1.0 }}\nv = {{ "
                  "initial = {3}, lower = 0.0, boundary = \"clamp\" }}\n[drift]\ns = \"{4}*s\"\nv = "
                  "\"{0}*({1} - v)\"\n[diffusion]\ns = [\"sqrt(v)*s\", \"0\"]\nv = [\"-0.7*{2}*sqrt(v)\", "
                  "\"sqrt(0.51)*{2}*sqrt(v)\"]\n",
                  a.kappa, a.theta, a.xi, a.v0, a.r),
      "heston");
}

/// In its root y, v = y^2, of either sign:  dy = ((kappa theta - xi^2/4)/(2 y) - kappa y/2) dt + xi/2 dB.
inline wienertree::TextModel heston_root(const HestonParameters& a) {
  return wienertree::TextModel::parse(
      fmt::format("name = \"heston\"\nconvention = \"ito\"\n[state]\ns = {{ initial = 1.0 }}\ny = {{ "
                  "initial = {3} }}\n[drift]\ns = \"{4}*s\"\ny = \"({0}*{1} - {2}^2/4)/(2*y) - "
                  "{0}*y/2\"\n[diffusion]\ns = [\"y*s\", \"0\"]\ny = [\"-0.35*{2}\", \"sqrt(0.51)*{2}/2\"]\n",
                  a.kappa, a.theta, a.xi, std::sqrt(a.v0), a.r),
      "heston");
}

struct KnownAverage {
  std::string name;
  wienertree::TextModel model;
  std::string payoff;
  double exact, known_to = 1e-11;
  double horizon = 1;
  std::optional<std::size_t> discount_state = {};
  std::string formula = {};  ///< empty: chosen
};

/// Black, Scholes (1973); Cox, Ingersoll, Ross (1985); Heston (1993), three sets of parameters, the last
/// beyond Feller's condition, 2 kappa theta < xi^2; Ninomiya, Victoir (2008), whose 6.04735e-2 is known to
/// 1.5e-6; and dX = (X/2 + sqrt(X^2+1)) dt + sqrt(X^2+1) dB, E q(asinh X_t) = t^3 - 3 t^2 + 2 t for
/// q = z^3 - 6 z^2 + 8 z.
inline std::vector<KnownAverage> known_averages() {
  const std::string z = "log(x + sqrt(x^2 + 1))";
  return {
      {"Black-Scholes, mean", bundled("gbm"), "s", 100 * std::exp(0.05)},
      {"Black-Scholes, call", bundled("gbm"), "exp(-r)*max(s - 100, 0)", 10.450583572186},
      {"Cox-Ingersoll-Ross, bond", bundled("cir").with_integrals({{"discount", "r", "discount"}}), "1",
       0.91397030320316, 1e-13, 1, 2},
      {"asinh, polynomial",
       wienertree::TextModel::parse("name = \"asinh\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.0 "
                                    "}\n[drift]\nx = \"x/2 + sqrt(x^2 + 1)\"\n[diffusion]\nx = [\"sqrt(x^2 + "
                                    "1)\"]\n",
                                    "asinh"),
       fmt::format("({0})^3 - 6*({0})^2 + 8*({0})", z), 0.375, 1e-14, 0.5},
      {"Heston, call", bundled("heston"), "max(s - 1.05, 0)", 0.125741987887},
      {"Heston, call, rho -0.7", heston(heston_b), "max(s - 1, 0)", 0.076157469179},
      {"Heston beyond Feller, in v", heston(heston_c), "exp(-0.0319)*max(s - 1, 0)", 0.068061133135},
      {"Heston beyond Feller, in sqrt v", heston_root(heston_c), "exp(-0.0319)*max(s - 1, 0)", 0.068061133135,
       1e-11, 1, std::nullopt, "ninomiya-victoir-5-2"},
      {"Heston, Asian call", bundled("heston").with_integrals({{"average_s", "s", "average"}}),
       "max(average_s - 1.05, 0)", 6.04735e-2, 1.5e-6},
  };
}

/// With the choices of the command line.
inline wienertree::ControlledResult to_tolerance(
    const KnownAverage& problem, double tolerance,
    wienertree::ThinningMethod thin = wienertree::ThinningMethod::recombination) {
  using namespace wienertree;
  const Model& model = problem.model.model();
  const std::vector<KinkedFunction> f = {problem.model.compile_kinked(problem.payoff, "payoff")};
  WeakTarget target;
  target.tolerance = tolerance;
  for (const CatalogueEntry& entry : bundled_formulas(formulas))
    if (entry.formula.name == problem.formula) target.formulas.push_back(entry.formula);
  for (const int degree : {5, 7, 9, 11}) try {
      if (problem.formula.empty())
        target.formulas.push_back(find_formula(degree, static_cast<int>(model.noise_dimension()), formulas));
    } catch (const InputError&) {  // not every degree has a formula
    }
  const std::size_t d = model.state_dimension() - (problem.discount_state ? 1 : 0);
  WeakRun run;
  run.options.thinning.method = thin;
  run.options.nodes = is_random(run.options) ? 10000 : d == 1 ? 100 : d == 2 ? 400 : 800;
  run.options.tolerance = {1e-6, 1e-8};
  run.options.discount_state = problem.discount_state;
  run.horizon = problem.horizon;
  if (!f[0].kinks.empty()) run.options.finest_along = f[0].kinks.front();
  for (const CubatureFormula& formula : target.formulas) target.guards.push_back(formula);
  if (target.formulas.size() > 2) target.formulas.pop_back();
  if (d == 1 && thin == ThinningMethod::recombination) {
    run.options.patch_width = 2;
    run.options.nodes = 100000;
  }
  const auto scales = kink_scales(model, f, problem.horizon, problem.discount_state);
  std::vector<std::vector<WeakPayoff>> rungs;
  if (last_step_smooths(scales[0]))
    rungs.push_back({WeakPayoff(f[0])});
  else
    for (int k = 0; k < 10; ++k)
      rungs.push_back({WeakPayoff(smooth_payoff(f[0], scales[0], 0.4 * std::exp2(-k / 4.0)))});
  return weak_to_tolerance(model, rungs, run, target);
}

inline void print(const std::string& name, double tolerance, const wienertree::ControlledResult& result,
                  double exact) {
  const wienertree::WeakErrorSplit& e = result.error[0];
  fmt::print(
      "{:<32} {:.0e}  error {:+.1e}, estimated {:.1e} = {:.1e} + {:.1e} + {:.1e} + {:.1e}; degree {}, "
      "n {}, N {}, {:.2g} solves\n",
      name, tolerance, result.value[0] - exact, e.total(), e.discretisation, e.thinning, e.ode, e.sampling,
      result.run.options.formula.degree, result.run.steps, result.run.options.nodes,
      static_cast<double>(result.ode_solves));
}

}  // namespace wienertree_test
