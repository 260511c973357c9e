/// Accuracy for the money. For every method the root mean square error of the posterior mean at T against the
/// exact filter, over observation paths and components, and the processor time of one run, all in one process:
///   B           Benes, mu 0.5, sigma 0.8, h1 0.4, x0 1, T 10; 10 paths
///   C           Benes, mu 0.05, sigma 1, h1 0.8, x0 0, T 20; 10 paths
///   linear-3d   the bundled model, d = 3, p = k = 2, T 5; 4 paths; against Kalman-Bucy
/// and the ratio of processor times at matched error (4e-3) between the Euler particle filter and the tree.
///
///     build/bench/bench/accuracy_per_second [TABLE.csv]            (about three minutes)
///     bench/draw-accuracy TABLE.csv PICTURE.svg
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/catalogue.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr double matched_error = 4e-3;

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Problem {
  std::string name;
  Model model;
  std::vector<ObservationPath> paths;
  std::vector<std::vector<double>> exact;  ///< each path's mean at T

  Problem(std::string title, const std::string& file, double horizon, std::uint32_t count,
          FilterMethod exact_filter)
      : name(std::move(title)), model(bundled_model(file)) {
    FilterOptions reference;
    reference.method = exact_filter;
    for (std::uint32_t i = 0; i < count; ++i) {
      paths.push_back(simulate(model, horizon, 1'000'000, 40'000, 2026, i).observations);
      exact.push_back(means(reference, 0, i));
    }
  }

  std::vector<double> means(const FilterOptions& options, std::size_t n, std::size_t path) const {
    const auto filter = make_filter(model, options);
    run(*filter, ObservationWindows(paths[path], model.observation, model.timing, n), {});
    std::vector<double> m;
    for (std::size_t i = 0; i < model.state_dimension(); ++i) m.push_back(mean(filter->posterior(), i));
    return m;
  }

  double squared_error(const FilterOptions& options, std::size_t n, std::size_t path) const {
    const std::vector<double> m = means(options, n, path);
    double sum = 0;
    for (std::size_t i = 0; i < m.size(); ++i) sum += std::pow(m[i] - exact[path][i], 2);
    return sum / static_cast<double>(m.size());
  }
};

struct Measured {
  double rmse, seconds;
};

// Short runs are repeated until a quarter of a second has passed, so that the clock resolves them.
Measured measure(const Problem& problem, const FilterOptions& options, std::size_t n) {
  double squares = 0;
  std::size_t runs = 0;
  const double start = processor_seconds();
  do {
    const std::size_t path = runs % problem.paths.size();
    const double square = problem.squared_error(options, n, path);
    if (runs < problem.paths.size()) squares += square;
    ++runs;
  } while (runs < problem.paths.size() || processor_seconds() - start < 0.25);
  return {std::sqrt(squares / static_cast<double>(problem.paths.size())),
          (processor_seconds() - start) / static_cast<double>(runs)};
}

struct Run {
  std::size_t n, N;
};

class Table {
 public:
  explicit Table(const char* file) : csv_(file == nullptr ? nullptr : std::fopen(file, "w")) {
    if (csv_ != nullptr) std::fputs("problem,method,n,N,rmse,seconds\n", csv_);
    fmt::print("| problem | {:<36} | {:>5} | {:>7} | {:>8} | s per run |\n|---|---|---|---|---|---|\n",
               "method", "n", "N", "RMSE");
  }
  ~Table() {
    if (csv_ != nullptr) std::fclose(csv_);
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  /// Measures the runs. @returns the processor time at the matched error: that of the cheapest run below it,
  /// or, for a method whose error is of Monte Carlo, of the most accurate one extrapolated by N^{-1/2}, in
  /// its favour (its discretisation error is taken to vanish as well); infinity if there is neither.
  double rows(const Problem& problem, const std::string& method, FilterOptions options,
              const std::vector<Run>& runs, bool monte_carlo = false) {
    double matched = INFINITY;
    for (const auto& [n, N] : runs) {
      options.nodes = N;
      const Measured m = measure(problem, options, n);
      fmt::print("| {:<9} | {:<36} | {:>5} | {:>7} | {:.2e} | {:.3g} |\n", problem.name, method, n, N, m.rmse,
                 m.seconds);
      std::fflush(stdout);
      if (csv_ != nullptr)
        std::fputs(
            fmt::format("{},\"{}\",{},{},{:.4g},{:.4g}\n", problem.name, method, n, N, m.rmse, m.seconds)
                .c_str(),
            csv_);
      if (m.rmse <= matched_error)
        matched = std::min(matched, m.seconds);
      else if (monte_carlo)
        matched = std::min(matched, m.seconds * std::pow(m.rmse / matched_error, 2));
    }
    return matched;
  }

 private:
  std::FILE* csv_;
};

FilterOptions particles(FilterMethod method) {
  FilterOptions o;
  o.method = method;
  o.functional = FunctionalMethod::picard;
  o.thinning = {ThinningMethod::tbba, SiteOrder::tree, 0};
  return o;
}

FilterOptions tree(const Problem& p, ThinningMethod method, SiteOrder order, FunctionalMethod functional) {
  FilterOptions o;
  o.formula = find_formula(5, static_cast<int>(p.model.noise_dimension()),
                           WIENERTREE_SOURCE_DIR "/data/cubature_formulas");
  o.thinning = {method, order, 0};
  o.functional = functional;
  return o;
}

void line(Table& table, const Problem& p) {
  using enum ThinningMethod;
  const auto second = FunctionalMethod::second_order;
  const double euler = table.rows(p, "Euler particles", particles(FilterMethod::euler),
                                  {{640, 1'000}, {640, 10'000}, {640, 100'000}, {1280, 100'000}}, true);
  FilterOptions mixture = particles(FilterMethod::gaussian_mixture);
  table.rows(p, "Gaussian mixture", mixture, {{160, 100}, {640, 1'000}, {640, 10'000}});
  table.rows(p, "tree, picard, TBBA in tree order", tree(p, tbba, SiteOrder::tree, FunctionalMethod::picard),
             {{640, 100}, {640, 1'000}});
  table.rows(p, "tree, second-order, TBBA in tree order", tree(p, tbba, SiteOrder::tree, second),
             {{40, 200}, {160, 10'000}});
  table.rows(p, "tree, second-order, TBBA", tree(p, tbba, SiteOrder::spatial, second),
             {{40, 200}, {80, 1'000}, {160, 10'000}});
  const double recombined =
      table.rows(p, "tree, second-order, recombination", tree(p, recombination, SiteOrder::spatial, second),
                 {{20, 8}, {36, 8}, {40, 15}, {80, 30}, {160, 40}, {320, 60}});
  fmt::print(
      "problem {}, processor time at RMSE {}: Euler {:.3g} s, tree with recombination {:.3g} s, ratio "
      "{:.0f}\n",
      p.name, matched_error, euler, recombined, euler / recombined);
}

void space(Table& table, const Problem& p) {
  using enum ThinningMethod;
  const auto second = FunctionalMethod::second_order;
  const double euler = table.rows(p, "Euler particles", particles(FilterMethod::euler),
                                  {{400, 1'000}, {400, 10'000}, {400, 100'000}}, true);
  table.rows(p, "tree, picard, TBBA", tree(p, tbba, SiteOrder::spatial, FunctionalMethod::picard),
             {{25, 2'000}, {50, 2'000}});
  table.rows(p, "tree, second-order, TBBA in tree order", tree(p, tbba, SiteOrder::tree, second),
             {{25, 2'000}, {50, 8'000}});
  table.rows(p, "tree, second-order, TBBA", tree(p, tbba, SiteOrder::spatial, second),
             {{25, 500}, {25, 2'000}, {50, 8'000}});
  const double recombined =
      table.rows(p, "tree, second-order, recombination", tree(p, recombination, SiteOrder::spatial, second),
                 {{12, 80}, {25, 150}, {50, 320}, {100, 640}});
  fmt::print(
      "problem {}, processor time at RMSE {}: Euler {:.3g} s, tree with recombination {:.3g} s, ratio "
      "{:.0f}\n",
      p.name, matched_error, euler, recombined, euler / recombined);
}

}  // namespace

int main(int count, char** arguments) {
  Table table(count > 1 ? arguments[1] : nullptr);
  line(table, {"C", "benes", 20.0, 10, FilterMethod::benes});
  line(table, {"B", "benes-convergence", 10.0, 10, FilterMethod::benes});
  space(table, {"linear-3d", "linear-3d", 5.0, 4, FilterMethod::kalman_bucy});
}
