/// The weighted particle filter and the overlap of its noise.
#include "wienertree/filter/weighted_filter.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "filter/text_problems.hpp"
#include "wienertree/filter/noise_overlap.hpp"

using namespace wienertree;

namespace {

constexpr NoiseLaw gaussian{NoiseLaw::Kind::gaussian, 0.7, 1}, laplace{NoiseLaw::Kind::laplace, 0.6, 1},
    student{NoiseLaw::Kind::student_t, 0.8, 5}, chi_square{NoiseLaw::Kind::log_chi_square, 1, 1};

std::string model_text(const std::string& observation) {
  return "name = \"w\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.2 }\n[drift]\nx = "
         "\"-0.3*x\"\n[diffusion]\nx = "
         "[\"0.5\"]\n[observation]\n" +
         observation;
}

FilterOptions weighted(std::size_t nodes) {
  FilterOptions o;
  o.method = FilterMethod::weighted;
  o.nodes = nodes;
  return o;
}

}  // namespace

TEST_CASE("the overlap of Gaussian, Laplace and log chi-square noise in closed form agrees with quadrature") {
  const double values[] = {-1.3, -0.4, 0.0, 0.3, 0.9};
  for (const double a : values)
    for (const double b : values) {
      for (const NoiseLaw& law : {gaussian, laplace}) {
        INFO(a << ", " << b);
        CHECK(noise_overlap(law, a, b) == Approx(noise_overlap_by_quadrature(law, a, b)).epsilon(1e-8));
      }
      if (std::exp(-a) + std::exp(-b) > 1.05)
        CHECK(noise_overlap(chi_square, a, b) ==
              Approx(noise_overlap_by_quadrature(chi_square, a, b)).epsilon(1e-7));
    }
  CHECK(noise_overlap(chi_square, 0.9, 0.9) == std::numeric_limits<double>::infinity());
}

TEST_CASE("the overlap with a state that is not seen is one, and it is symmetric") {
  for (const NoiseLaw& law : {gaussian, laplace, student, chi_square})
    for (const double a : {-2.0, -0.5, 0.8}) {
      CHECK(noise_overlap(law, 0, a) == Approx(1).epsilon(1e-8));
      CHECK(noise_overlap(law, a, -0.4) == Approx(noise_overlap(law, -0.4, a)).epsilon(1e-9));
    }
}

TEST_CASE("the weighted filter's likelihood ratios are those of a filter that is never resampled") {
  const Model model = parse_model(
      model_text("kind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"laplace\", scale = 0.6 }"), "w.toml");
  ObservationPath path = simulate(model, 3, 300, 6, 2).observations;
  path.values[2] = NAN;
  const ObservationWindows windows(path, model.observation, model.timing, 0);
  const auto filter = make_filter(model, weighted(500));
  run(*filter, windows, {});
  FilterOptions euler = weighted(500);
  euler.method = FilterMethod::euler;
  euler.thinning.method = ThinningMethod::none;
  const auto reference = make_filter(model, euler);
  run(*reference, windows, {});
  const Posterior& p = filter->posterior();
  CHECK(p.log_evidence == reference->posterior().log_evidence);
  double log_noise_of_all = 0, mean = 0, square = 0;
  for (const double y : path.values)
    if (!std::isnan(y)) log_noise_of_all += -std::abs(y) / 0.6 - std::log(1.2);
  const LikelihoodRatio ratio = *filter->likelihood_ratio();
  CHECK(ratio.log_mean == Approx(p.log_evidence - log_noise_of_all).epsilon(1e-12));
  for (std::size_t n = 0; n < p.size(); ++n) {
    const double L = p.weight[n] * 500 * std::exp(ratio.log_mean);
    mean += L / 500;
    square += L * L / 500;
  }
  CHECK(ratio.log_variance == Approx(std::log(square - mean * mean)).epsilon(1e-9));
  CHECK(ratio.effective_size == Approx(effective_sample_size(p)));
  CHECK_FALSE(ratio.collapsed());
}

TEST_CASE("the weighted filter collapses on a long record, and says so") {
  const Model model = parse_model(
      model_text("kind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.1 }"), "w.toml");
  const auto path = simulate(model, 40, 4000, 40, 2).observations;
  const auto filter = make_filter(model, weighted(500));
  run(*filter, ObservationWindows(path, model.observation, model.timing, 0), {});
  CHECK(filter->likelihood_ratio()->collapsed());
}

TEST_CASE("the weighted filter refuses what has no noise to compare with") {
  CHECK_THROWS_WITH(make_filter(benes_cases[0].model(), weighted(10)), Catch::Contains("discrete"));
  const Model expression =
      parse_model(model_text("kind = \"discrete\"\nlog_likelihood = \"-(y1-x)^2\""), "w.toml");
  CHECK_THROWS_WITH(make_filter(expression, weighted(10)), Catch::Contains("noise"));
}
