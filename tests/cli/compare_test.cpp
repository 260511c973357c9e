/// `wienertree compare`, and the weighted filter's report.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.hpp"

using namespace cli;

namespace {

const std::string dax = "--observations " WIENERTREE_SOURCE_DIR "/data/observations/dax.csv ";

}  // namespace

TEST_CASE("compare tells evidences, Bayes factors and probabilities of two parameter sets") {
  const Workplace place;
  const Outcome told =
      place.run("compare stochastic-volatility stochastic-volatility:phi=0.95,s=0.3,beta=0.7 " + dax +
                "--method grid --output out.csv --format csv");
  REQUIRE(told.code == 0);
  const Columns table(place.read("out.csv"));
  CHECK(table["log_evidence_1"].back() == Approx(-2511.197502).margin(1e-5));
  CHECK(table["log_evidence_2"].back() == Approx(-2520.781821).margin(1e-5));
  CHECK(table["log_bayes_factor_2"].back() == Approx(-9.584319).margin(2e-5));
  CHECK(table["probability_2"].back() == Approx(1 / (1 + std::exp(9.584319))).epsilon(1e-3));
  for (std::size_t r = 0; r < table["t"].size(); ++r) {
    CHECK(table["probability_1"][r] + table["probability_2"][r] == Approx(1));
    CHECK(table["log_bayes_factor_2"][r] ==
          Approx(table["log_evidence_2"][r] - table["log_evidence_1"][r]).margin(1e-9));
  }
  CHECK_THAT(told.err, Catch::Contains("-2511.197502") && Catch::Contains("-9.584319") &&
                           Catch::Contains("stochastic-volatility:phi=0.95,s=0.3,beta=0.7"));
}

TEST_CASE("compare by launches tells standard errors, of the size of the errors") {
  const Workplace place;
  simulate_benes(place);
  const std::string models = "compare benes benes:h1=0.6 benes:mu=0.5 --observations Y.csv --steps 50 ";
  const Columns exact(output_of(place, models + "--method benes --quiet"));
  const Columns table(output_of(place, models + "--method euler --nodes 500 --launches 30 --quiet"));
  for (const char* m : {"1", "2", "3"}) {
    const double se = table[std::string("se_log_evidence_") + m].back();
    CHECK(se > 0);
    CHECK(se < 0.1);
    // The step's error is below 0.02 here; |t| > 9 on 29 degrees of freedom: 7e-10.
    CHECK(std::abs(table[std::string("log_evidence_") + m].back() -
                   exact[std::string("log_evidence_") + m].back()) < 9 * se + 0.02);
  }
  // One launch of a hundred particles: its error is told from further ones.
  CHECK_THAT(place.run(models + "--method euler --nodes 100 --output o.csv").err,
             Catch::Contains("the tolerance 0.02 is not reached"));
}

TEST_CASE("a model's own parameters go before those of all") {
  const Workplace place;
  simulate_benes(place);
  const Columns table(output_of(
      place, "compare benes benes:h1=0.6 --set h1=0.7 --observations Y.csv --method benes --quiet"));
  const Columns one(
      output_of(place, "filter benes --set h1=0.7 --observations Y.csv --method benes --quiet"));
  const Columns two(
      output_of(place, "filter benes --set h1=0.6 --observations Y.csv --method benes --quiet"));
  CHECK(table["log_evidence_1"].back() == one["log_evidence"].back());
  CHECK(table["log_evidence_2"].back() == two["log_evidence"].back());
}

TEST_CASE("compare writes JSON and draws a picture") {
  const Workplace place;
  simulate_benes(place);
  REQUIRE(place
              .run("compare benes benes:h1=0.6 --method klv --observations Y.csv --output out.json --format "
                   "json --plot p.svg")
              .code == 0);
  const auto report = nlohmann::json::parse(place.read("out.json"));
  CHECK(report["models"][1]["parameters"]["h1"] == 0.6);
  CHECK(report["models"][0]["options"]["method"] == "klv");
  CHECK(report["rows"].back().contains("log_bayes_factor_2"));
  CHECK_THAT(place.read("p.svg"), Catch::Contains("<svg") && Catch::Contains("benes:h1=0.6"));
}

TEST_CASE("compare refuses what cannot be compared, with place and value") {
  const Workplace place;
  simulate_benes(place);
  const std::string rest = " --observations Y.csv";
  const auto refuses = [&](const std::string& command, const std::string& what) {
    INFO(command);
    const Outcome outcome = place.run(command);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::Contains(what));
  };
  refuses("compare benes" + rest, "two models");
  refuses("compare benes benes" + rest, "twice");
  refuses("compare benes benes:h9=1" + rest, "h9");
  refuses("compare benes benes:h1=x" + rest, "x");
  refuses("compare benes benes:=1" + rest, "NAME=VALUE");
  refuses("compare benes benes:h1=1,,mu=2" + rest, "NAME=VALUE");
  refuses("compare benes nile" + rest, "observe the same");
  refuses("compare benes gbm" + rest, "[observation]");
  refuses("compare benes benes:h1=0.6 --observations -", "--observations");
  refuses("compare benes benez" + rest, "benes");
}

TEST_CASE("the weighted filter tells its Bayes factor against noise, and when it has collapsed") {
  const Workplace place;
  place.write("m.toml",
              "name = \"m\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\n[drift]\nx = "
              "\"-x\"\n[diffusion]\nx = [1]\n"
              "[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.2 }\n");
  REQUIRE(place.run("simulate m.toml --horizon 30 --steps 3000 --keep 60 --observations Y.csv").code == 0);
  const Outcome outcome =
      place.run("filter m.toml --observations Y.csv --method weighted --nodes 1000 --output out.csv");
  REQUIRE(outcome.code == 0);
  CHECK_THAT(outcome.err,
             Catch::Contains("log Bayes factor") && Catch::Contains("warning: the weights collapsed at t ="));
  const Columns table(place.read("out.csv"));
  double log_noise = 0;
  const Columns rows(place.read("Y.csv"));
  for (const double y : rows["y1"])
    log_noise += -0.5 * y * y / 0.04 - std::log(0.2 * std::sqrt(2 * std::acos(-1.0)));
  CHECK(table["log_bayes_factor"].back() == Approx(table["log_evidence"].back() - log_noise).epsilon(1e-9));
  CHECK(table["ess"].back() < 10);
  const Outcome refused = place.run("filter m.toml --observations Y.csv --method weighted --thin tbba");
  CHECK(refused.code == 2);
  CHECK_THAT(refused.err, Catch::Contains("--thin"));
}
