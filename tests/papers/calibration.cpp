/// Simulation-based calibration (Cook, Gelman, Rubin 2006, J. Comput. Graph. Statist. 15, 675-692; Talts et
/// al. 2018): if the signal and its observations are drawn from the model, the posterior's distribution
/// function at the true X_T is uniform on [0, 1]. A posterior that is too narrow, too wide, shifted, or that
/// belongs to another time is not.
///
/// Null hypothesis of each row: uniform. Draws: the number below, in 10 bins. Pearson's statistic has about a
/// chi-square law with 9 degrees of freedom; a row fails where that has a tail below 1e-7, so that the 12
/// rows together raise fewer than 2e-6 false alarms. With 600 draws a standard deviation that is wrong by a
/// factor of 1.5 makes the statistic about 120, where the bound is 52; one wrong by 1.15 about 165 with 6000
/// (label slow).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <catch2/catch.hpp>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/construct.hpp"
#include "wienertree/filter/marginal.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

constexpr std::uint32_t draws = WIENERTREE_LAUNCHES;
constexpr std::size_t bins = 10;
constexpr double least_tail = 1e-7;

struct Problem {
  std::string name;
  Model model;
  double horizon;
  std::size_t fine_steps, rows, steps;  ///< steps of the filters; 0: one a row
};

// A start that is random, a signal that is not Gaussian, a sensor that is not monotone.
Model double_well() {
  return parse_model(R"TOML(
name = "double well"
convention = "ito"
[state]
x = { initial = 0.2 }
[drift]
x = "x - x^3"
[diffusion]
x = ["0.8"]
[observation]
kind = "discrete"
h = ["x + 0.3*x^2"]
noise = { law = "student-t", dof = 5, scale = 0.5 }
[initial]
mean = [0.2]
covariance = [[0.3]]
)TOML",
                     "double well");
}

std::vector<Problem> problems() {
  return {{"Benes, continuous", bundled_model("benes-convergence"), 2, 2000, 40, 20},
          {"double well, discrete", double_well(), 2, 2000, 10, 0}};
}

struct Method {
  std::string name;
  FilterOptions options;
  std::size_t finer = 1;  ///< steps, as a multiple of the problem's: a method of first order needs more
};

std::vector<Method> methods() {
  FilterOptions klv;
  klv.formula = construct_lyons_victoir_5_1();
  klv.nodes = 40;
  klv.thinning = {ThinningMethod::recombination, SiteOrder::spatial, 0};
  FilterOptions sampled = klv;
  sampled.nodes = 400;
  sampled.thinning = {ThinningMethod::tbba, SiteOrder::spatial, 0};
  FilterOptions euler = sampled;
  euler.method = FilterMethod::euler;
  FilterOptions half = euler;
  half.ess_threshold = 0.5;
  FilterOptions mixture = euler;
  mixture.method = FilterMethod::gaussian_mixture;
  FilterOptions grid;
  grid.method = FilterMethod::grid;
  return {{"KLV, recombination", klv},       {"KLV, TBBA", sampled},           {"Euler", euler, 2},
          {"Euler, ESS below 0.5", half, 2}, {"Gaussian mixture", mixture, 2}, {"grid", grid}};
}

double statistic(const std::vector<double>& histogram) {
  const double expected = draws / static_cast<double>(bins);
  double sum = 0;
  for (const double count : histogram) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

}  // namespace

TEST_CASE("calibration: the posterior's distribution function at the truth is uniform") {
  const boost::math::chi_squared law(bins - 1);
  for (const Problem& problem : problems()) {
    std::vector<Simulation> data;
    for (std::uint32_t i = 0; i < draws; ++i)
      data.push_back(simulate(problem.model, problem.horizon, problem.fine_steps, problem.rows, 11, i));
    fmt::print("\n{}: {} draws\n\n| method | chi-square (9) | tail | bins |\n|---|---|---|---|\n",
               problem.name, draws);
    for (const Method& method : methods()) {
      std::vector<double> histogram(bins, 0.0);
      for (std::uint32_t i = 0; i < draws; ++i) {
        FilterOptions o = method.options;
        o.launch = i;
        const auto filter = make_filter(problem.model, o);
        run(*filter,
            ObservationWindows(data[i].observations, problem.model.observation, problem.model.timing,
                               problem.steps * method.finer),
            {});
        const double u = Marginal(filter->posterior(), 0).distribution(data[i].signal.values.back());
        ++histogram[std::min(bins - 1, static_cast<std::size_t>(u * bins))];
      }
      const double x = statistic(histogram), tail = boost::math::cdf(complement(law, x));
      fmt::print("| {} | {:.1f} | {:.2g} | {} |\n", method.name, x, tail, fmt::join(histogram, " "));
      std::fflush(stdout);
      CAPTURE(problem.name, method.name, x);
      CHECK(tail > least_tail);
    }
  }
}
