#pragma once
/// Reference problems with discrete observations: the Nile and the volatility of the DAX.
#include <cmath>
#include <string>
#include <vector>

#include "wienertree/cubature/catalogue.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::papers {

inline std::string source(const std::string& path) { return std::string(WIENERTREE_SOURCE_DIR) + "/" + path; }

inline CubatureFormula bundled_formula(int degree, int dimension) {
  return find_formula(degree, dimension, source("data/cubature_formulas"));
}

/// Parameters of the stochastic volatility model with the exact log-likelihood of data/observations/dax.csv.
struct VolatilityCase {
  double phi, s, beta, log_evidence;
};
inline constexpr VolatilityCase volatility_cases[] = {{0.97, 0.2, 0.9, -2511.197502},
                                                      {0.95, 0.3, 0.7, -2520.781821}};

struct DiscreteProblem {
  Model model;
  ObservationPath path;

  DiscreteProblem(const std::string& model_name, const std::string& observations,
                  const ParameterOverrides& parameters = {})
      : model(load_model(source("data/models/" + model_name + ".toml"), parameters)),
        path(read_observations(source("data/observations/" + observations + ".csv"), 1,
                               ObservationKind::discrete)) {}
  static DiscreteProblem dax(const VolatilityCase& c) {
    return {"stochastic-volatility", "dax", {{"phi", c.phi}, {"s", c.s}, {"beta", c.beta}}};
  }

  ObservationWindows windows(std::size_t steps_a_gap) const {
    return {path, model.observation, model.timing, steps_a_gap * (path.rows() - 1)};
  }
  std::unique_ptr<Filter> filtered(const FilterOptions& options, std::size_t steps_a_gap) const {
    auto filter = make_filter(model, options);
    run(*filter, windows(steps_a_gap), {});
    return filter;
  }
  double log_evidence(const FilterOptions& options, std::size_t steps_a_gap) const {
    return filtered(options, steps_a_gap)->posterior().log_evidence;
  }
};

}  // namespace wienertree::papers
