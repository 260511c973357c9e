/// The default filter on problems whose sensors are far from linear, against quadrature.
///
/// Signals are linear with independent states, x_i -> F_i x_i + N(0, Q_i), so that the exact filter is a matter of
/// quadrature: the law on a grid of n points an axis, moved by one Gaussian kernel an axis (the trapezoidal rule,
/// which errs by 2 exp(-2 pi^2 Q/spacing^2) a step) and multiplied by the likelihood. Source of truth: that grid.
///
/// Criterion: posterior means within 0.02, quantiles within 0.05 posterior standard deviations, standard deviations
/// within 2 %, log evidence within 0.02, at every row, which is what a tolerance of 0.02 promises; or a warning, where
/// `warned` allows it. And the estimates of the error: never below a third of the error, of what exceeds a quarter of
/// the tolerance, without a warning.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/controlled_filter.hpp"

using namespace wienertree;

namespace {

const std::filesystem::path formulas =
    std::filesystem::path(WIENERTREE_SOURCE_DIR) / "data/cubature_formulas";

struct Problem {
  std::string observation;
  std::vector<double> rate, sigma, mean, variance;  // dx_i = -rate_i x_i dt + sigma_i dB_i; the start
  double gap;
  std::vector<double> y;
  bool warned = false;  // the answer may be off where that is said
};

Model model_of(const Problem& p) {
  static const char* const names[] = {"x", "z"};
  const std::size_t d = p.rate.size();
  std::string state, drift, diffusion, mean, covariance;
  for (std::size_t i = 0; i < d; ++i) {
    state += fmt::format("{} = {{}}\n", names[i]);
    drift += fmt::format("{} = \"-{}*{}\"\n", names[i], p.rate[i], names[i]);
    std::string row, variances;
    for (std::size_t j = 0; j < d; ++j) {
      row += fmt::format("{}{}", j > 0 ? ", " : "", i == j ? p.sigma[i] : 0.0);
      variances += fmt::format("{}{}", j > 0 ? ", " : "", i == j ? p.variance[i] : 0.0);
    }
    diffusion += fmt::format("{} = [{}]\n", names[i], row);
    mean += fmt::format("{}{}", i > 0 ? ", " : "", p.mean[i]);
    covariance += fmt::format("{}[{}]", i > 0 ? ", " : "", variances);
  }
  return parse_model(
      fmt::format("name = \"sensor\"\nconvention = \"ito\"\n[state]\n{}[drift]\n{}[diffusion]\n{}"
                  "[observation]\nkind = \"discrete\"\n{}\n[initial]\nmean = [{}]\ncovariance = [{}]\n",
                  state, drift, diffusion, p.observation, mean, covariance),
      "sensor.toml");
}

struct Row {
  double log_evidence;
  std::vector<double> mean, sd, q05, q95;
};

class GridOracle {
 public:
  explicit GridOracle(const Problem& p) : d_(p.rate.size()), n_(d_ == 1 ? 4001 : 241) {
    double size = 1;
    for (std::size_t i = 0; i < d_; ++i) {
      const double F = std::exp(-p.rate[i] * p.gap);
      const double Q = p.sigma[i] * p.sigma[i] * (1 - F * F) / (2 * p.rate[i]);
      const double widest = std::max(p.variance[i], p.sigma[i] * p.sigma[i] / (2 * p.rate[i]));
      reach_.push_back(std::abs(p.mean[i]) + 6 * std::sqrt(widest));
      spacing_.push_back(2 * reach_[i] / static_cast<double>(n_ - 1));
      kernel_.emplace_back(n_ * n_);
      for (std::size_t a = 0; a < n_; ++a)
        for (std::size_t b = 0; b < n_; ++b) {
          const double off = at(i, a) - F * at(i, b);
          kernel_[i][a * n_ + b] =
              std::exp(-off * off / (2 * Q)) / std::sqrt(2 * std::numbers::pi * Q) * spacing_[i];
        }
      size *= static_cast<double>(n_);
    }
    law_.resize(static_cast<std::size_t>(size));
    x_.reshape(d_, law_.size());
    for (std::size_t k = 0; k < law_.size(); ++k) {
      law_[k] = 1;
      std::size_t rest = k;
      for (std::size_t i = 0; i < d_; ++i, rest /= n_) {
        x_(i, k) = at(i, rest % n_);
        const double u = x_(i, k) - p.mean[i];
        law_[k] *= std::exp(-u * u / (2 * p.variance[i])) / std::sqrt(2 * std::numbers::pi * p.variance[i]) *
                   spacing_[i];
      }
    }
  }

  void move() {
    std::vector<double> moved(law_.size());
    for (std::size_t i = 0, stride = 1; i < d_; ++i, stride *= n_) {
      std::fill(moved.begin(), moved.end(), 0.0);
      for (std::size_t k = 0; k < law_.size(); ++k) {
        if (!(law_[k] > 1e-18)) continue;
        const std::size_t b = k / stride % n_, first = k - b * stride;
        for (std::size_t a = 0; a < n_; ++a) moved[first + a * stride] += kernel_[i][a * n_ + b] * law_[k];
      }
      law_.swap(moved);
    }
  }

  Row observe(const Model& model, double y) {
    std::vector<double> value(law_.size()), observed = {y};
    model.density->log_density(observed, x_, value);
    double mass = 0;
    for (std::size_t k = 0; k < law_.size(); ++k) mass += law_[k] *= std::exp(value[k]);
    for (double& w : law_) w /= mass;
    log_evidence_ += std::log(mass);
    Row row;
    row.log_evidence = log_evidence_;
    for (std::size_t i = 0, stride = 1; i < d_; ++i, stride *= n_) {
      std::vector<double> marginal(n_, 0.0);
      for (std::size_t k = 0; k < law_.size(); ++k) marginal[k / stride % n_] += law_[k];
      double mean = 0, second = 0;
      for (std::size_t a = 0; a < n_; ++a) mean += marginal[a] * at(i, a);
      for (std::size_t a = 0; a < n_; ++a) second += marginal[a] * (at(i, a) - mean) * (at(i, a) - mean);
      row.mean.push_back(mean);
      row.sd.push_back(std::sqrt(second));
      const auto quantile = [&](double level) {
        double below = 0;  // mass up to half a cell beyond node a - 1
        std::size_t a = 0;
        while (below + marginal[a] < level) below += marginal[a++];
        return at(i, a) + ((level - below) / marginal[a] - 0.5) * spacing_[i];
      };
      row.q05.push_back(quantile(0.05));
      row.q95.push_back(quantile(0.95));
    }
    return row;
  }

 private:
  double at(std::size_t i, std::size_t a) const { return -reach_[i] + spacing_[i] * static_cast<double>(a); }

  std::size_t d_, n_;
  double log_evidence_ = 0;
  std::vector<double> reach_, spacing_, law_;
  std::vector<std::vector<double>> kernel_;
  Batch x_;
};

std::vector<Problem> problems() {
  const std::string gaussian = "]\nnoise = { law = \"gaussian\", sd = ";
  std::vector<Problem> all = {// One state.
                              {"h = [\"x\"]\nnoise = { law = \"laplace\", scale = 0.3 }",
                               {0.5},
                               {0.8},
                               {0},
                               {0.64},
                               0.5,
                               {0.5, 1.4, 1.1, -0.2, -1.5, 0.1}},
                              {"h = [\"x\"]\nnoise = { law = \"student-t\", dof = 3, scale = 0.15 }",
                               {0.5},
                               {0.8},
                               {0},
                               {0.64},
                               0.5,
                               {0.3, -2.5, 0.4, 1.2, 1.0, -0.3}},
                              {"h = [\"exp(1.5*x)\"" + gaussian + "0.3 }",
                               {0.5},
                               {0.8},
                               {0},
                               {0.64},
                               0.5,
                               {0.9, 2.5, 0.1, 0.05, 0.6, 1.8}},
                              {"h = [\"sin(2*x)\"" + gaussian + "0.15 }",
                               {0.5},
                               {0.8},
                               {0},
                               {0.64},
                               0.5,
                               {0.5, 0.9, 1.05, 0.3, -0.6, -0.9}},
                              // Two states: a distance, a bearing, a parabola, a product.
                              {"h = [\"sqrt((x - 1)^2 + (z + 2)^2)\"" + gaussian + "0.15 }",
                               {0.5, 0.4},
                               {0.7, 0.5},
                               {0, 0},
                               {0.5, 0.3},
                               0.4,
                               {2.0, 2.4, 1.6, 2.9, 2.2}},
                              {"h = [\"atan((x + 3)/(z + 4))\"" + gaussian + "0.04 }",
                               {0.5, 0.4},
                               {0.7, 0.5},
                               {0, 0},
                               {0.5, 0.3},
                               0.4,
                               {0.70, 0.62, 0.55, 0.75, 0.85}}};
#if WIENERTREE_FULL
  all.push_back({"h = [\"x^2 - z\"" + gaussian + "0.2 }",
                 {0.5, 0.4},
                 {0.7, 0.5},
                 {0, 0},
                 {0.5, 0.3},
                 0.4,
                 {0.6, 1.4, 1.1, 0.2, -0.4}});
  all.push_back({"h = [\"x*z\"" + gaussian + "0.2 }",
                 {0.5, 0.4},
                 {0.7, 0.5},
                 {0.5, 0},
                 {0.5, 0.3},
                 0.4,
                 {0.3, 0.8, -0.5, 0.1, 0.6},
                 true});
  all.push_back({"h = [\"sqrt(x^2 + z^2)\"" + gaussian + "0.1 }",
                 {0.5, 0.5},
                 {0.7, 0.7},
                 {0, 0},
                 {1, 0.5},
                 0.4,
                 {2.5, 2.2, 1.6, 1.1, 0.6},
                 true});
  all.push_back({"log_likelihood = \"y1*(x + z) - exp(x + z)\"",
                 {0.5, 0.4},
                 {0.7, 0.5},
                 {0, 0},
                 {0.5, 0.3},
                 0.4,
                 {1, 3, 4, 0, 0, 2}});
#endif
  return all;
}

}  // namespace

TEST_CASE("nonlinear sensors: right within the tolerance, or said not to be") {
  for (const Problem& problem : problems()) {
    const Model model = model_of(problem);
    const std::size_t d = problem.rate.size();
    ObservationPath path;
    path.dimension = 1;
    GridOracle oracle(problem);
    std::vector<Row> exact;
    for (std::size_t r = 0; r < problem.y.size(); ++r) {
      path.append(problem.gap * static_cast<double>(r), std::span(problem.y).subspan(r, 1));
      if (r > 0) oracle.move();
      exact.push_back(oracle.observe(model, problem.y[r]));
    }
    ControlOptions control;
    control.formulas = formulas;
    ControlledFilter filter(model, recommended_options(model, {}, formulas), control, path);
    while (filter.advance()) {
    }
    AnswerError error;
    REQUIRE(filter.answer().rows.size() == exact.size());
    for (std::size_t r = 0; r < exact.size(); ++r) {
      const PosteriorSummary& got = filter.answer().rows[r].mean;
      error.log_evidence = std::max(error.log_evidence, std::abs(got.log_evidence - exact[r].log_evidence));
      for (std::size_t i = 0; i < d; ++i) {
        const double sd = exact[r].sd[i];
        error.mean = std::max(error.mean, std::abs(got.mean[i] - exact[r].mean[i]) / sd);
        error.sd = std::max(error.sd, std::abs(got.sd[i] - sd) / sd);
        error.quantile = std::max({error.quantile, std::abs(got.q05[i] - exact[r].q05[i]) / sd,
                                   std::abs(got.q95[i] - exact[r].q95[i]) / sd});
      }
    }
    const AnswerError told = filter.accuracy().error;
    const bool warns = !filter.warnings().empty();
    const std::string report = fmt::format(
        "{}: mean {:.1e} (told {:.1e}), sd {:.1e} ({:.1e}), quantiles {:.1e} ({:.1e}), log evidence {:.1e} "
        "({:.1e}){}",
        problem.observation, error.mean, told.mean, error.sd, told.sd, error.quantile, told.quantile,
        error.log_evidence, told.log_evidence, warns ? ", with a warning" : "");
    INFO(report);
    fmt::print("{}\n", report);
    if (problem.warned && warns) continue;
    CHECK(!warns);
    CHECK(error.within(0.02));
    // Estimates of less than a quarter of the tolerance are not held to anything.
    CHECK(error.mean < 3 * told.mean + 0.005);
    CHECK(error.sd < 3 * told.sd + 0.005);
    CHECK(error.quantile < 3 * told.quantile + 0.0125);
    CHECK(error.log_evidence < 3 * told.log_evidence + 0.005);
  }
}
