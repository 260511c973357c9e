#pragma once
/// Models and observation paths that several tests of this room use.
#include <string>

#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree {

inline Model benes_model(double mu, double sigma, double h1, double h2, double x0) {
  const auto n = [](double v) { return std::to_string(v); };
  return parse_model("name = \"benes\"\nconvention = \"ito\"\n[parameters]\nmu = " + n(mu) +
                         "\nsigma = " + n(sigma) + "\nh1 = " + n(h1) + "\nh2 = " + n(h2) +
                         "\n[state]\nx = { initial = " + n(x0) +
                         " }\n[drift]\nx = \"mu*sigma*tanh(mu*x/sigma)\"\n[diffusion]\nx = [\"sigma\"]\n"
                         "[observation]\nkind = \"continuous\"\nh = [\"h1*x + h2\"]\n",
                     "benes.toml", {});
}

/// The four Benes problems A to D of the literature, with their horizons.
struct BenesCase {
  const char* name;
  double mu, sigma, h1, h2, x0, horizon;
  Model model() const { return benes_model(mu, sigma, h1, h2, x0); }
};
inline constexpr BenesCase benes_cases[] = {{"A", 2.2, 2.2, 0.15, 0, 0, 10},
                                            {"B", 0.5, 0.8, 0.4, 0, 1, 10},
                                            {"C", 0.05, 1, 0.8, 0, 0, 20},
                                            {"D", 0.3, 1, 0.8, 0, 0, 10}};

}  // namespace wienertree
