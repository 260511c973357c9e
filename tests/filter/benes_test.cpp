#include "wienertree/filter/benes_filter.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "filter/text_problems.hpp"

using namespace wienertree;

namespace {

struct TwoGaussians {
  double mean_plus, mean_minus, variance, weight_plus;
};

// The published form: Psi_t, A+-, B, with Psi by the trapezoidal rule on the rows.
TwoGaussians published_form(const BenesParameters& p, const ObservationPath& path) {
  const double t0 = path.times.front(), T = path.times.back() - t0, c = p.h1 * p.sigma;
  const auto ratio = [&](double s) {
    return std::exp(c * (s - T)) * std::expm1(-2 * c * s) / std::expm1(-2 * c * T);
  };
  double psi = 0;
  for (std::size_t r = 0; r + 1 < path.rows(); ++r)
    psi += (ratio(path.times[r] - t0) + ratio(path.times[r + 1] - t0)) / 2 *
           (path.row(r + 1)[0] - path.row(r)[0]);
  const double inverse_sinh = -2 * std::exp(-c * T) / std::expm1(-2 * c * T), coth = 1 / std::tanh(c * T);
  const auto A = [&](double sign) {
    return sign * p.mu / p.sigma + p.h1 * psi + (p.h2 + p.h1 * p.x0) * inverse_sinh / p.sigma -
           p.h2 / p.sigma * coth;
  };
  const double B = p.h1 / (2 * p.sigma) * coth, a = A(1), b = A(-1);
  return {a / (2 * B), b / (2 * B), 1 / (2 * B), 1 / (1 + std::exp((b * b - a * a) / (4 * B)))};
}

}  // namespace

TEST_CASE("the exact filter equals its published form on all four problems, and with an offset h2") {
  for (BenesCase c : benes_cases)
    for (const double h2 : {0.0, 0.3}) {
      c.h2 = h2;
      const Model model = c.model();
      const auto path = simulate(model, c.horizon, 20000, 20000, 5).observations;
      BenesFilter filter(model);
      run(filter, ObservationWindows(path, model.observation, model.timing, 10), {});
      const Posterior& p = filter.posterior();
      const TwoGaussians e = published_form(*model.benes, path);
      INFO("problem " << c.name << " h2 " << h2);
      // Both integrate the same rows, one exactly on each gap, one by the trapezoidal rule: they differ by (c
      // dt)^2/12 relative, with c dt at most 1e-3.
      CHECK(p.points(0, 0) == Approx(e.mean_plus).epsilon(1e-6).margin(1e-6));
      CHECK(p.points(0, 1) == Approx(e.mean_minus).epsilon(1e-6).margin(1e-6));
      CHECK(p.variance_of(0, 0) == Approx(e.variance).epsilon(1e-12));
      CHECK(p.weight[0] == Approx(e.weight_plus).epsilon(1e-5).margin(1e-300));
    }
}

TEST_CASE("the evidence obeys the innovations formula d log rho = h^ dY - h^^2 dt/2") {
  for (const BenesCase& c : benes_cases) {
    const Model model = c.model();
    constexpr std::size_t rows = 100'000;
    const auto path = simulate(model, c.horizon, rows, rows, 6).observations;
    BenesFilter filter(model);
    ObservationWindows windows(path, model.observation, model.timing, 0);
    ObservationWindow w;
    double expected = 0, h = c.h1 * c.x0 + c.h2, largest_gain = 0;
    for (std::size_t j = 0; j < windows.size(); ++j) {
      windows.get(j, w);
      expected += h * w.increment[0] - h * h / 2 * w.length();
      filter.advance(w);
      const Posterior& p = filter.posterior();
      h = c.h1 * mean(p, 0) + c.h2;
      largest_gain = std::max(largest_gain, c.h1 * c.h1 * covariance(p, 0, 0));
    }
    // The left-point Ito sum differs from the integral by sum of gain ((dW)^2 - dt)/2, of variance at most
    // gain^2 T dt/2.
    const double sd = largest_gain * std::sqrt(c.horizon * c.horizon / rows / 2);
    INFO("problem " << c.name << ", tolerance " << 6 * sd);
    CHECK(filter.posterior().log_evidence == Approx(expected).margin(6 * sd));
    CHECK(6 * sd < 0.7);
  }
}

TEST_CASE("without observation the exact filter is the prior law, and nothing overflows at T = 1000") {
  Model prior = benes_cases[0].model();
  prior.observation = ObservationKind::none;
  BenesFilter filter(prior);
  ObservationWindow w;
  w.end = 8.3;
  filter.advance(w);
  CHECK(filter.posterior().points(0, 0) == Approx(2.2 * 2.2 * 8.3));
  CHECK(filter.posterior().variance_of(0, 0) == Approx(2.2 * 2.2 * 8.3));
  CHECK(filter.posterior().weight[0] == 0.5);
  CHECK(filter.posterior().log_evidence == 0.0);

  for (const BenesCase& c : benes_cases) {
    const Model model = c.model();
    const auto path = simulate(model, 1000, 20000, 20000, 8).observations;
    for (const std::size_t steps : {std::size_t{0}, std::size_t{1}}) {
      BenesFilter f(model);
      run(f, ObservationWindows(path, model.observation, model.timing, steps), {});
      PosteriorSummary s;
      summarise(f.posterior(), 1, 4, s);
      CHECK((std::isfinite(s.mean[0]) && std::isfinite(s.sd[0]) && std::isfinite(s.log_evidence)));
      CHECK((std::isfinite(s.q05[0]) && std::isfinite(s.q95[0])));
    }
  }
}
