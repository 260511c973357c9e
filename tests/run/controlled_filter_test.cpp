/// The resolution that is chosen, the estimate of its error against exact answers, and that a search goes on where it
/// was put down.
#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/filter/simulate.hpp"
#include "wienertree/model/text_model.hpp"
#include "wienertree/numeric/memory.hpp"
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

TEST_CASE("nodes are not doubled for what steps that are given leave") {
  const Model model = scalar_model("x - x^3", continuous);
  const ObservationPath y = simulate(model, 2, 2000, 1000, 5, 0).observations;
  GivenOptions given = klv();
  given.degree = 3;
  ControlOptions options = control();
  options.steps = 10;
  options.tolerance = 1e-3;
  const ControlledFilter filter = searched(model, given, options, y);
  CHECK_FALSE(filter.accuracy().reached);
  CHECK(filter.answer_setup().options.nodes <= 120);  // 61440 were tried once
}

TEST_CASE("an error is not known where the run that would tell it was given up") {
  const Model model = scalar_model("-x", discrete);
  const ObservationPath y = simulate(model, 8, 4000, 20, 5, 0).observations;
  GivenOptions given = klv();
  given.conditioning = Conditioning::children;
  given.nodes = 400;
  ControlOptions options = control();
  options.nodes_given = true;
  options.steps = 80;
  const ControlledFilter whole = searched(model, given, options, y);
  REQUIRE(whole.accuracy().known);
  // Enough for the two levels, and too little for the run of twice the steps.
  options.work = 0.45 * whole.work();
  const ControlledFilter cut = searched(model, given, options, y);
  REQUIRE(cut.answer().level == 1);
  CHECK_FALSE(cut.accuracy().known);
  CHECK_FALSE(cut.accuracy().reached);
  REQUIRE_FALSE(cut.warnings().empty());
  CHECK(cut.warnings().back().find("the error is not known: the run with") == 0);
  CHECK(cut.warnings().back().find("the work is spent") != std::string::npos);
}

TEST_CASE("what the spacing of rows leaves is told without finer levels, and cells of a grid are work") {
  const Model model = scalar_model("-x", continuous);
  ObservationPath y{1, {}, {}};
  y.append(0, std::vector{0.0});
  y.append(1, std::vector{1.0});
  GivenOptions given;
  given.method = FilterMethod::grid;
  const ControlledFilter filter = searched(model, given, control(), y);
  CHECK_FALSE(filter.accuracy().reached);
  CHECK(filter.answer().level <= 2);
  CHECK(filter.work() > 1000);
  CHECK(filter.work() < 1e6);
}

TEST_CASE("components that are divided are work, and a level without memory leaves the answer below it") {
  const Model ring = parse_model(
      "name = \"ring\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.5 }\nz = { initial = 0 }\n"
      "[drift]\nx = \"-x\"\nz = \"-z\"\n[diffusion]\nx = [0.7, 0]\nz = [0, 0.7]\n[observation]\n"
      "kind = \"discrete\"\nh = [\"sin(3*x)*cos(2*z)\"]\nnoise = { law = \"gaussian\", sd = 0.05 }\n",
      "ring.toml", {});
  ObservationPath y{1, {}, {}};
  for (const double t : {0.5, 1.0}) y.append(t, std::vector{0.3});
  ControlOptions options = control();
  options.tolerance = 1e-9;
  options.work = 3e6;
  const ControlledFilter filter = searched(ring, klv(), options, y);
  CHECK(filter.answer().statistics.conditioned > 100);
  CHECK(filter.work() > 80 * static_cast<double>(filter.answer().statistics.conditioned));
  CHECK(filter.work() < 1e8);
  const double limit = memory_limit();
  set_memory_limit(4e6);  // 400 nodes take 2.2 MB, the next level four times that
  options.work = 1e12;
  const ControlledFilter small = searched(ring, klv(), options, y);
  set_memory_limit(limit);
  CHECK(small.answer().level >= 1);
  CHECK_FALSE(small.accuracy().reached);
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
