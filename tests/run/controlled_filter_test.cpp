/// The resolution that is chosen, the estimate of its error against exact answers, and that a search goes on where it
/// was put down.
#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/run/controlled_filter.hpp"

using namespace wienertree;

namespace {

const std::filesystem::path formulas =
    std::filesystem::path(WIENERTREE_SOURCE_DIR) / "data/cubature_formulas";

Model scalar_model(const std::string& drift, const std::string& observation) {
  return parse_model("name = \"m\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.2 }\n[drift]\nx = \"" +
                         drift + "\"\n[diffusion]\nx = [\"0.7\"]\n[observation]\n" + observation,
                     "m.toml", {});
}

const std::string continuous = "kind = \"continuous\"\nh = [\"1.5*x\"]\n";
const std::string discrete = "kind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.5 }\n";

ControlOptions control() {
  ControlOptions options;
  options.formulas = formulas;
  return options;
}

ControlledFilter searched(const Model& model, const GivenOptions& given, const ControlOptions& options,
                          const ObservationPath& y) {
  ControlledFilter filter(model, recommended_options(model, given, formulas), options, y);
  while (filter.advance()) {
  }
  return filter;
}

GivenOptions klv() {
  GivenOptions given;
  given.method = FilterMethod::klv;
  return given;
}

}  // namespace

TEST_CASE("a model with an exact filter is filtered by it, unless nodes are asked for") {
  const Model linear = scalar_model("-x", discrete);
  CHECK(recommended_options(linear, {}, formulas).options.method == FilterMethod::kalman);
  GivenOptions nodes;
  nodes.nodes = 30;
  CHECK(recommended_options(linear, nodes, formulas).options.method == FilterMethod::klv);
  CHECK(recommended_options(scalar_model("x - x^3", discrete), {}, formulas).options.method ==
        FilterMethod::klv);
}

TEST_CASE("the estimate is not below the error of a linear model's answer, nor far above it") {
  for (const std::string& observation : {continuous, discrete}) {
    const Model model = scalar_model("-x", observation);
    const bool rows = observation == continuous;
    const ObservationPath y = simulate(model, 4, 4000, rows ? 2000 : 20, 3, 0).observations;
    const ControlledFilter tree = searched(model, klv(), control(), y),
                           exact = searched(model, {}, control(), y);
    REQUIRE(exact.answer_setup().options.method == (rows ? FilterMethod::kalman_bucy : FilterMethod::kalman));
    REQUIRE(tree.answer().rows.size() == exact.answer().rows.size());
    const AnswerError error = largest(differences(exact.answer().rows, tree.answer().rows));
    const Accuracy told = tree.accuracy();
    INFO((rows ? "continuous" : "discrete"));
    CHECK(told.reached);
    CHECK(tree.warnings().empty());
    // Both answers err: what lies between them is at most the sum of their errors.
    const AnswerError own = exact.accuracy().error;
    CHECK(told.error.mean + own.mean >= error.mean);
    CHECK(told.error.sd + own.sd >= error.sd);
    CHECK(told.error.quantile + own.quantile >= error.quantile);
    CHECK(told.error.log_evidence + own.log_evidence >= error.log_evidence);
    CHECK(error.mean <= 0.02);
    CHECK(error.log_evidence <= 0.02);
  }
}

TEST_CASE("what is given stays, and an error above the tolerance is told") {
  const Model model = scalar_model("x - x^3", discrete);
  const ObservationPath y = simulate(model, 10, 4000, 20, 5, 0).observations;
  GivenOptions given = klv();
  given.nodes = 4;
  ControlOptions options = control();
  options.nodes_given = true;
  options.steps = 20;
  options.tolerance = 1e-7;
  const ControlledFilter filter = searched(model, given, options, y);
  CHECK(filter.answer_setup().options.nodes == 4);
  CHECK(filter.answer().statistics.steps <= 21);
  CHECK(filter.answer().rows.size() == 21);
  CHECK_FALSE(filter.accuracy().reached);
  REQUIRE_FALSE(filter.warnings().empty());
  CHECK(filter.warnings().back().find("1e-07") != std::string::npos);
}

TEST_CASE("a search that is put down goes on to the same answer") {
  const Model model = scalar_model("x - x^3", continuous);
  const ObservationPath y = simulate(model, 2, 2000, 1000, 5, 0).observations;
  const FilterSetup setup = recommended_options(model, klv(), formulas);
  const ControlledFilter whole = searched(model, klv(), control(), y);
  for (const int windows : {1, 99, 150, 400}) {
    std::string bytes;
    {
      ControlledFilter first(model, setup, control(), y);
      for (int k = 0; k < windows && first.advance(); ++k) {
      }
      StateArchive archive;
      first.exchange(archive);
      bytes = archive.bytes();
    }
    ControlledFilter second(model, setup, control(), y);
    StateArchive archive(bytes);
    second.exchange(archive);
    archive.finish();
    while (second.advance()) {
    }
    CHECK(largest(differences(whole.answer().rows, second.answer().rows)).within(0));
    CHECK(second.accuracy().error.mean == whole.accuracy().error.mean);
    CHECK(second.work() == whole.work());
  }
}

TEST_CASE("t is the time of the record") {
  const Model from_0 = scalar_model("-x + sin(2*t)", discrete),
              from_2000 = scalar_model("-x + sin(2*(t - 2000))", discrete);
  const ObservationPath y = simulate(from_0, 6, 4000, 25, 7, 0).observations;
  ObservationPath later = y;
  for (double& t : later.times) t += 2000;
  for (const FilterMethod method : {FilterMethod::klv, FilterMethod::euler, FilterMethod::gaussian_mixture}) {
    GivenOptions given;
    given.method = method;
    given.nodes = method == FilterMethod::klv ? 40 : 500;
    const ControlledFilter a = searched(from_0, given, control(), y),
                           b = searched(from_2000, given, control(), later);
    REQUIRE(a.answer().rows.size() == b.answer().rows.size());
    // Differences of times lose 13 bits near 2000: 2e-13 each.
    for (std::size_t r = 0; r < a.answer().rows.size(); ++r)
      CHECK(a.answer().rows[r].mean.mean[0] == Approx(b.answer().rows[r].mean.mean[0]).margin(1e-9));
  }
}
