// What `wienertree format` prints is what the readers accept.
#include <catch2/catch.hpp>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "program.hpp"

using namespace cli;

namespace {

// The example of a format as a file.
void write_example(const Workplace& w, const std::string& format, const std::string& file) {
  w.write(file, output_of(w, "format " + format + " --example"));
}

}  // namespace

TEST_CASE("every example is accepted by the reader of its format") {
  Workplace w;
  write_example(w, "model", "m.toml");
  CHECK(output_of(w, "model show m.toml").find("pendulum: 2 states, 1 Brownian motion") == 0);
  write_example(w, "formula", "f.json");
  CHECK(output_of(w, "formulas verify f.json").find("f.json") == 0);
  write_example(w, "observations", "Y.csv");
  CHECK(lines_of(output_of(w, "filter benes --method klv --observations Y.csv --quiet --output -")).size() ==
        1 + 5);
  CHECK(lines_of(
            output_of(w, "filter m.toml --observations Y.csv --steps 4 --formula f.json --quiet --output -"))
            .size() > 5);
  write_example(w, "study", "s.toml");
  const Outcome outcome = w.run("study s.toml --output out");
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(w.read("out/claims.csv").find(",true,true") != std::string::npos);
}

TEST_CASE("a format's text ends in its example, and says of each key what holds without it") {
  Workplace w;
  for (const char* format : {"model", "formula", "observations", "study"}) {
    const std::string name = format, text = output_of(w, "format " + name);
    CHECK(text.ends_with("Example\n\n" + output_of(w, "format " + name + " --example")));
  }
  CHECK(output_of(w, "format study").find("how often a cell that draws random numbers is run [1]") !=
        std::string::npos);
  const Outcome none = w.run("format checkpoint --example");
  CHECK(none.code == 2);
  CHECK(none.err.find("--example: there is no example") != std::string::npos);
  CHECK(w.run("format modle").err.find("did you mean 'model'?") != std::string::npos);
}

TEST_CASE("every key is told of in the page of its format") {
  Workplace w;
  const std::map<std::string, std::string> pages = {
      {"model", "models.md"}, {"formula", "formulas.md"}, {"study", "study-file.md"}};
  for (const auto& [format, page] : pages) {
    std::ostringstream told;
    told << std::ifstream(WIENERTREE_SOURCE_DIR "/docs/" + page).rdbuf();
    const std::string text = output_of(w, "format " + format);
    const std::regex key("\n  ([a-z_]+) ");
    int keys = 0;
    for (std::sregex_iterator at(text.begin(), text.end(), key), end; at != end; ++at, ++keys) {
      INFO(page << ": " << (*at)[1]);
      CHECK(told.str().find((*at)[1]) != std::string::npos);
    }
    CHECK(keys >= 14);
  }
}

TEST_CASE("a checkpoint is laid out as its format says") {
  Workplace w;
  simulate_benes(w);
  REQUIRE(
      w.run("filter benes --observations Y.csv --nodes 10 --quiet --output p.csv --checkpoint save").code ==
      0);
  CHECK(output_of(w, "format checkpoint").find('"' + lines_of(w.read("save")).front() + '"') !=
        std::string::npos);
}
