#pragma once
/// Reference problems with Benes' model: observation paths, the exact answer on them, and the error of a
/// filter.
#include <cmath>
#include <string>
#include <vector>

#include "wienertree/filter/benes_filter.hpp"
#include "wienertree/filter/filter.hpp"
#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"

namespace wienertree::papers {

inline Model bundled_model(const std::string& name) {
  return load_model(std::string(WIENERTREE_SOURCE_DIR) + "/data/models/" + name + ".toml");
}

inline double exact_mean(const Model& model, const ObservationPath& path) {
  BenesFilter exact(model);
  run(exact, ObservationWindows(path, model.observation, model.timing, 0), {});
  return mean(exact.posterior(), 0);
}

/// Observation paths simulated by Euler on 10^6 steps, of which `rows` are kept, with the exact posterior
/// mean at T.
struct BenesProblem {
  Model model;
  std::vector<ObservationPath> paths;
  std::vector<double> exact;

  BenesProblem(const std::string& name, double horizon, std::size_t path_count, std::size_t rows = 40'000)
      : model(bundled_model(name)) {
    for (std::size_t i = 0; i < path_count; ++i) {
      paths.push_back(
          simulate(model, horizon, 1'000'000, rows, 2026, static_cast<std::uint32_t>(i)).observations);
      exact.push_back(exact_mean(model, paths.back()));
    }
  }

  /// Error of the posterior mean at T on one path.
  double error(const FilterOptions& options, std::size_t n, std::size_t path) const {
    const auto filter = make_filter(model, options);
    run(*filter, ObservationWindows(paths[path], model.observation, model.timing, n), {});
    return mean(filter->posterior(), 0) - exact[path];
  }

  /// Root mean square over the paths.
  double rmse(const FilterOptions& options, std::size_t n) const {
    double sum = 0;
    for (std::size_t i = 0; i < paths.size(); ++i) sum += std::pow(error(options, n, i), 2);
    return std::sqrt(sum / static_cast<double>(paths.size()));
  }
};

/// Least-squares slope of log y against log x.
inline double log_slope(const std::vector<double>& x, const std::vector<double>& y) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double a = std::log(x[i]), b = std::log(y[i]);
    sx += a;
    sy += b;
    sxx += a * a;
    sxy += a * b;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace wienertree::papers
