/// What the program says: options as they are typed, warnings that --quiet does not silence, the solver's words explained.
#include <catch2/catch.hpp>

#include "program.hpp"

using namespace cli;

TEST_CASE("an option is called as it is typed, also by the library") {
  const Workplace place;
  simulate_benes(place);
  const std::string filter = "filter benes --observations Y.csv ";
  for (const auto& [arguments, told] : std::vector<std::pair<std::string, std::string>>{
           {filter + "--method euler --ess-threshold 2", "--ess-threshold: must lie between 0 and 1 (2)"},
           {filter + "--method gaussian-mixture --alpha 2", "--alpha: "},
           {filter + "--method gaussian-mixture --beta -1", "--beta: "},
           {filter + "--method grid --nodes 1", "--nodes: must be at least"},
           {filter + "--steps 401", "--steps: "},
           {"simulate benes --horizon 1 --steps 10 --keep 3 --observations Z.csv", "--keep: "}}) {
    const Outcome outcome = place.run(arguments);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::StartsWith("wienertree: " + told));
  }
}

TEST_CASE("two dashes end the options") {
  const Workplace place;
  simulate_benes(place);
  const std::string usual = output_of(place, "filter benes --observations Y.csv --nodes 20 --quiet");
  CHECK(output_of(place, "filter --observations Y.csv --nodes 20 --quiet -- benes") == usual);
  CHECK(output_of(place, "filter --nodes 20 --quiet -- benes Y.csv") == usual);
  CHECK(output_of(place, "filter --observations Y.csv --nodes 20 --quiet benes --") == usual);
  CHECK(place.run("filter --observations Y.csv -- benes --nodes").code == 2);
  CHECK(output_of(place, "formulas show -- lyons-victoir-5-1") ==
        output_of(place, "formulas show lyons-victoir-5-1"));
  CHECK(output_of(place, "weak --horizon 1 --steps 2 --payoff s --quiet -- gbm").substr(0, 6) == "payoff");
}

TEST_CASE("a seed is accepted where nothing is random, and changes nothing there") {
  const Workplace place;
  simulate_benes(place);
  for (const std::string options : {"--nodes 20", "--method benes", "--method grid --nodes 400",
                                    "--method full-tree --steps 4", "--thin levelwise --nodes 20"})
    for (const char* format : {" --format csv", " --format json"}) {
      const std::string filter = "filter benes --observations Y.csv --quiet " + options + format;
      CHECK(output_of(place, filter + " --seed 7") == output_of(place, filter));
    }
  CHECK(place.run("weak gbm --horizon 1 --steps 2 --payoff s --seed 3").code == 0);
  CHECK(place.run("weak gbm --horizon 1 --steps 2 --payoff s --thin none --seed 3").code == 0);
  CHECK(place.run("tree benes --horizon 1 --steps 2 --thin none --seed 3 --dot t.dot").code == 0);
  CHECK(place.run("compare benes benes:mu=0.5 --observations Y.csv --method benes --seed 3").code == 0);
  // Any other option that means nothing is refused.
  CHECK(place.run("filter benes --observations Y.csv --method benes --launches 3").code == 2);
}

TEST_CASE("a collapse of the weights is told with --quiet too") {
  const Workplace place;
  place.write(
      "m.toml",
      "convention = \"ito\"\n[state]\nx = { initial = 0 }\n[drift]\nx = \"-x\"\n[diffusion]\nx = "
      "[1]\n[observation]\nkind = \"discrete\"\nh = [\"x\"]\nnoise = { law = \"gaussian\", sd = 0.01 }\n");
  std::string rows = "t,y1\n";
  for (int i = 0; i < 20; ++i) rows += std::to_string(i) + "," + std::to_string(i % 3) + "\n";
  place.write("Y.csv", rows);
  const std::string filter =
      "filter m.toml --observations Y.csv --method weighted --nodes 50 --output out.csv";
  for (const std::string quiet : {"", " --quiet"}) {
    const Outcome outcome = place.run(filter + quiet);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    std::size_t warnings = 0;
    for (const std::string& line : lines_of(outcome.err))
      warnings += line.starts_with("warning: the weights collapsed at t = ") ? 1 : 0;
    CHECK(warnings == 1);
    // The other one is the accuracy control's: the tolerance is not reached.
    if (!quiet.empty()) CHECK(lines_of(outcome.err).size() == 2);
  }
}

TEST_CASE("the solver's own words come with what they mean and what to try") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n0.1,0.1\n0.2,0.1\n");
  place.write("m.toml",
              "convention = \"ito\"\n[state]\nx = { initial = 3.0 }\n[drift]\nx = \"x^3\"\n[diffusion]\nx = "
              "[1]\n[observation]\nkind = \"continuous\"\nh = [\"x\"]\n");
  for (const char* flow : {"cvode", "explicit"}) {
    const Outcome outcome = place.run("filter m.toml --observations Y.csv --flow " + std::string(flow));
    CHECK(outcome.code == 1);
    CHECK_THAT(outcome.err, Catch::Contains("the state grows without bound") && Catch::Contains("--steps") &&
                                Catch::Contains("--rtol") && Catch::Contains("the solver says: "));
    CHECK(lines_of(outcome.err).size() == 1);
  }
}
