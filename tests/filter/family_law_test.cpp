/// The conditioned law of a family: distribution function, density and quantiles against a fine midpoint rule.
#include "wienertree/filter/family_law.hpp"

#include <catch2/catch.hpp>

#include "wienertree/filter/family_conditioning.hpp"
#include "wienertree/model/text_model.hpp"

using namespace wienertree;

namespace {

// The law of a family N(0.3, 1) with skewness .2 and excess kurtosis .1 that y = 1.2 was observed of.
FamilyUpdate conditioned(const std::string& observation, const LineBounds& bounds, std::vector<double>& x,
                         std::vector<double>& below) {
  const std::string state =
      bounds.bounded() ? "{ initial = 0.3, lower = 0, boundary = \"clamp\" }" : "{ initial = 0.3 }";
  const Model model = parse_model("name = \"line\"\nconvention = \"ito\"\n[state]\nx = " + state +
                                      "\n[drift]\nx = \"-x\"\n[diffusion]\nx = [\"0.8\"]\n[observation]\n"
                                      "kind = \"discrete\"\n" +
                                      observation + "\n",
                                  "line.toml");
  Families family;
  family.add(0, 0.3, 1);
  family.shape = {FamilyShape::of(0.2, 0.1)};
  ObservationWindow window;
  window.observation = {1.2};
  FamilyConditioning conditioning(model);
  FamilyUpdate update;
  conditioning.condition(family, window, 0, 120, update);
  update.law.normalise(bounds);
  // Cells of 1e-4: the midpoint rule errs by their square, and by 1e-4 of a cell's mass at a kink.
  const double width = 1e-4, first = bounds.bounded() ? 0.0 : -6.0;
  Batch point(1, 1);
  std::vector<double> value(1);
  double sum = 0;
  for (int k = 0; first + k * width < 7; ++k) {
    point(0, 0) = first + (k + 0.5) * width;
    const double z = family.shape[0].inverse(point(0, 0) - 0.3);
    model.density->log_density(window.observation, point, value);
    sum += std::exp(value[0] - z * z / 2) / family.shape[0].slope(z);
    x.push_back(first + (k + 1) * width);
    below.push_back(sum);
  }
  for (double& v : below) v /= sum;
  return update;
}

}  // namespace

TEST_CASE("the law of a conditioned family is that of quadrature, for smooth likelihoods and others") {
  const std::string observation =
      GENERATE("h = [\"exp(x)\"]\nnoise = { law = \"gaussian\", sd = 0.5 }",
               "h = [\"x\"]\nnoise = { law = \"gaussian\", sd = 1.0 }",
               "h = [\"x\"]\nnoise = { law = \"laplace\", scale = 0.2 }",
               "h = [\"x\"]\nnoise = { law = \"student-t\", dof = 3, scale = 0.1 }",
               "h = [\"x^2\"]\nnoise = { law = \"gaussian\", sd = 0.1 }");
  const bool bounded = GENERATE(false, true);
  LineBounds bounds;
  if (bounded) bounds.lower = 0;
  INFO(observation << ", bounded " << bounded);
  std::vector<double> x, below;
  const FamilyUpdate update = conditioned(observation, bounds, x, below);
  double largest = 0;
  for (std::size_t k = 0; k < x.size(); k += 97)
    largest = std::max(largest, std::abs(update.law.distribution(x[k]) - below[k]));
  // A family is accepted as smooth where two coefficients are below 1e-3, tables are cubic between nodes of
  // intervals that are right to 1e-9.
  CHECK(largest < 1e-4);
  const double levels[] = {0.05, 0.5, 0.95};
  double quantile[3];
  update.law.quantiles(levels, quantile);
  for (int q = 0; q < 3; ++q) {
    CHECK(update.law.distribution(quantile[q]) == Approx(levels[q]).margin(1e-8));
    CHECK((!bounded || quantile[q] >= 0));
    // The density is the derivative of the distribution function.
    const double e = 1e-4, slope = (update.law.distribution(quantile[q] + e) -
                                    update.law.distribution(std::max(bounds.lower, quantile[q] - e))) /
                                   (quantile[q] + e - std::max(bounds.lower, quantile[q] - e));
    CHECK(update.law.density(quantile[q]) == Approx(slope).margin(0.02));
  }
}

TEST_CASE("a law comes back from its bytes, and points have no density") {
  std::vector<double> x, below;
  FamilyUpdate update =
      conditioned("h = [\"x\"]\nnoise = { law = \"laplace\", scale = 0.2 }", LineBounds{}, x, below);
  StateArchive out;
  update.law.exchange(out);
  const std::string bytes = out.bytes();
  StateArchive in(bytes);
  FamilyLaw law;
  law.clear();
  law.exchange(in);
  in.finish();
  law.normalise({});
  CHECK(law.distribution(1) == update.law.distribution(1));
  CHECK(law.has_density());
  Families points;
  points.add(0, 1, 0);
  points.add(0, 2, 0);
  law.set(points);
  law.normalise({});
  CHECK(!law.has_density());
  CHECK(law.distribution(1.5) == 0.5);
}
