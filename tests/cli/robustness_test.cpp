/// Bad input of every kind gives one clear line with place and value, the right exit code, and no output.
#include <catch2/catch.hpp>

#include "program.hpp"

namespace {

using cli::Outcome;
using cli::Workplace;

constexpr const char* toml = R"(name = "small"
convention = "ito"
[state]
x = { initial = 1.0 }
[drift]
x = "-x"
[diffusion]
x = ["1"]
[observation]
kind = "continuous"
h = ["x"]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

// One line that names the place, and nothing else anywhere.
void check_refusal(const Workplace& place, const std::string& arguments, int code,
                   const std::vector<std::string>& told) {
  const std::vector<std::string> before = place.files();
  const Outcome outcome = place.run(arguments);
  INFO(arguments << "\n" << outcome.err);
  CHECK(outcome.code == code);
  CHECK(outcome.signal == 0);
  CHECK(outcome.out.empty());
  CHECK(cli::lines_of(outcome.err).size() == 1);
  CHECK_THAT(outcome.err, Catch::StartsWith("wienertree: ") && Catch::EndsWith("\n"));
  for (const std::string& part : told) CHECK_THAT(outcome.err, Catch::Contains(part));
  CHECK(place.files() == before);
}

}  // namespace

TEST_CASE("wrong usage is refused with the option, the value and the nearest right name") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter = "filter benes --observations Y.csv ";
  struct Case {
    std::string arguments;
    std::vector<std::string> told;
  };
  const std::vector<Case> cases = {
      {"", {"a subcommand is needed", "filter"}},
      {"fliter benes", {"unknown subcommand", "fliter", "did you mean 'filter'"}},
      {"formulas", {"formulas", "a subcommand is needed", "verify"}},
      {"formulas lst", {"lst", "did you mean 'list'"}},
      {filter + "--node 10", {"filter", "unknown option", "--node", "did you mean '--nodes'"}},
      {filter + "--degre=5", {"--degre", "did you mean '--degree'"}},
      {filter + "stray", {"one argument too many", "stray"}},
      {"filter benes --method klv", {"filter", "--observations"}},
      {"filter", {"filter", "MODEL"}},
      {filter + "--nodes 0", {"--nodes", "at least 1", "(0)"}},
      {filter + "--nodes -5", {"--nodes", "(-5)"}},
      {filter + "--nodes many", {"--nodes", "whole number", "(many)"}},
      {filter + "--nodes 1e3", {"--nodes", "(1e3)"}},
      {filter + "--nodes 99999999999999999999", {"--nodes", "(99999999999999999999)"}},
      {filter + "--nodes 10 --nodes 20", {"--nodes"}},
      {filter + "--nodes", {"--nodes"}},
      {filter + "--steps 0", {"--steps", "(0)"}},
      {filter + "--steps 401", {"steps", "400", "(401)"}},
      {filter + "--rtol nan", {"--rtol", "finite", "(nan)"}},
      {filter + "--atol -1e-3", {"--atol", "positive", "(-1e-3)"}},
      {filter + "--thin recombinaton", {"--thin", "did you mean 'recombination'", "(recombinaton)"}},
      {filter + "--method kvl", {"--method", "did you mean 'klv'", "(kvl)"}},
      {filter + "--degree 4", {"4"}},
      {filter + "--degree 5 --formula lyons-victoir-5-1", {"--formula", "not both"}},
      {filter + "--formula lyons-victor-5-1", {"--formula", "did you mean 'lyons-victoir-5-1'"}},
      {filter + "--formula lyons-victoir-5-2", {"--formula", "2 Brownian motions", "1"}},
      {filter + "--set mo=1", {"mo", "did you mean 'mu'"}},
      {filter + "--set mu", {"--set", "NAME=VALUE", "(mu)"}},
      {filter + "--set mu=x", {"--set mu", "number", "(x)"}},
      {filter + "--moments 1", {"--moments", "(1)"}},
      {filter + "--format xml", {"--format", "csv, json", "(xml)"}},
      {filter + "--plot p.pdf", {"--plot", ".svg or .png", "(p.pdf)"}},
      {filter + "--density-at 2", {"--density-at", "--plot"}},
      {filter + "--plot p.svg --density-at 5", {"--density-at", "0 .. 4", "(5)"}},
      {filter + "--signal X.csv", {"--signal", "--plot"}},
      {filter + "--launches 3 --thin recombination", {"--launches", "recombination"}},
      {filter + "--order tree --thin recombination", {"--order", "recombination"}},
      {filter + "--recombination-degree 5 --thin tbba", {"--recombination-degree", "tbba"}},
      {filter + "--method benes --nodes 10", {"--nodes", "benes"}},
      {filter + "--method full-tree --thin tbba", {"--thin", "full-tree"}},
      {filter + "--method full-tree --steps 100", {"unpruned tree", "3^100"}},
      {filter + "--method euler --degree 5", {"--degree", "euler"}},
      {filter + "--method euler --ess-threshold 2", {"ess-threshold", "(2)"}},
      {filter + "--method klv --alpha 0.5", {"--alpha", "klv"}},
      {filter + "--method euler --beta 0.5", {"--beta", "euler"}},
      {filter + "--method gaussian-mixture --alpha 2", {"alpha", "(2)"}},
      {filter + "--method gaussian-mixture --beta -1", {"beta", "(-1)"}},
      {filter + "--method gaussian-mixture --thin none", {"--thin", "gaussian-mixture"}},
      {filter + "--method gaussian-mixture --ess-threshold 0.5", {"--ess-threshold", "gaussian-mixture"}},
      {filter + "--method weighted", {"weighted", "discrete"}},
      {filter + "--ess-threshold 0.5", {"--ess-threshold", "--thin recombination"}},
      {filter + "--method grid --ess-threshold 0.5", {"--ess-threshold", "grid"}},
      {filter + "--output missing/out.csv", {"--output", "no such directory", "missing/out.csv"}},
      {filter + "--output .", {"--output", "directory"}},
      {filter + "--observations - --steps 5", {"--observations"}},
      {"filter cir --observations Y.csv", {"observation"}},
      {"filter lorenz36 --observations Y.csv", {"did you mean 'lorenz63'", "(lorenz36)"}},
      {"filter linear-3d --method klv --observations Y.csv", {"Y.csv:1", "t,y1,y2"}},
      {"filter benes --method klv --observations none.csv", {"none.csv"}},
      {"filter benes --method klv --observations .", {"."}},
      {"simulate benes --horizon -1 --steps 10 --observations Z.csv", {"--horizon", "positive", "(-1)"}},
      {"simulate benes --horizon nan --steps 10 --observations Z.csv", {"--horizon", "(nan)"}},
      {"simulate benes --horizon 1 --steps 0 --observations Z.csv", {"--steps", "(0)"}},
      {"simulate benes --horizon 1 --steps 10 --keep 3 --observations Z.csv", {"keep", "10", "(3)"}},
      {"simulate benes --horizon 1 --steps 10", {"--observations"}},
      {"simulate benes --steps 10 --observations Z.csv", {"--horizon"}},
      {"simulate cir --horizon 1 --steps 10 --observations Z.csv", {"--observations"}},
      {"formulas construct --degree 4 --dimension 2", {"4"}},
      {"formulas show nothing", {"no bundled formula", "(nothing)"}},
      {"formulas verify none.json", {"none.json"}},
      {"model show none.toml", {"none.toml"}},
      {"tree benes --steps 3 --dot T.dot", {"--horizon", "--observations"}},
      {"tree benes --horizon 1 --steps 3", {"--dot"}},
      {"tree benes --horizon 1 --dot t.dot", {"--steps"}},
      {"tree benes --horizon 1 --steps 30 --thin none --dot t.dot", {"nodes", "30 steps"}},
  };
  for (const Case& c : cases) check_refusal(place, c.arguments, 2, c.told);
}

TEST_CASE("observations that are wrong are refused with file, line and column") {
  const Workplace place;
  place.write("m.toml", toml);
  struct Case {
    std::string csv;
    std::vector<std::string> told;
  };
  const std::vector<Case> cases = {
      {"", {"bad.csv", "t,y1"}},
      {"t,y1\n", {"bad.csv", "no rows"}},
      {"t,y1\n0,0\n", {"bad.csv", "two rows"}},
      {"time,y1\n0,0\n1,1\n", {"bad.csv:1", "t,y1"}},
      {"t,y1,y2\n0,0,0\n1,1,1\n", {"bad.csv:1", "t,y1"}},
      {"t,y1\n0,0\n1\n", {"bad.csv:3", "y1"}},
      {"t,y1\n0,0\n1,", {"bad.csv:3", "y1"}},
      {"t,y1\n0,0\n1,1,1\n", {"bad.csv:3"}},
      {"t,y1\n0,0\n1,nan\n", {"bad.csv:3", "y1", "(nan)"}},
      {"t,y1\n0,0\n1,1e999\n", {"bad.csv:3", "1e999"}},
      {"t,y1\n0,0\n1,one\n", {"bad.csv:3", "(one)"}},
      {"t,y1\n0,0\n2,1\n1,1\n", {"bad.csv:4", "increase"}},
      {"t,y1\n0,0\n1,1\n1,1\n", {"bad.csv:4", "increase"}},
      {std::string("t,y1\n0,0\n\0\0\x01,1\n", 15), {"bad.csv:3"}},
  };
  for (const Case& c : cases) {
    place.write("bad.csv", c.csv);
    check_refusal(place, "filter m.toml --observations bad.csv", 2, c.told);
  }
}

TEST_CASE("models that are wrong are refused with file, line and key") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n0.1,0.1\n0.2,0.1\n");
  struct Case {
    std::string from, to;
    std::vector<std::string> told;
  };
  const std::vector<Case> cases = {
      {"\"-x\"", "\"-z\"", {"m.toml:6", "drift.x", "z"}},
      {"\"-x\"", "\"-x*\"", {"m.toml:6", "drift.x"}},
      {"\"-x\"", "\"-x", {"m.toml:6"}},
      {"[\"1\"]", "\"1\"", {"m.toml:8", "diffusion"}},
      {"x = [\"1\"]", "x = [\"1\"]\ny = [\"1\"]", {"m.toml:9", "y"}},
      {"x = [\"1\"]", "", {"m.toml", "diffusion"}},
      {"[drift]", "[drfit]", {"m.toml", "drfit", "drift"}},
      {"continuous", "continous", {"m.toml:10", "continous", "continuous"}},
      {"1.0", "\"nan\"", {"m.toml:4"}},
  };
  for (const Case& c : cases) {
    place.write("m.toml", replaced(toml, c.from, c.to));
    check_refusal(place, "filter m.toml --observations Y.csv", 2, c.told);
    check_refusal(place, "model show m.toml", 2, c.told);
  }
}

TEST_CASE("a formula with one digit changed is refused with the word") {
  const Workplace place;
  cli::simulate_benes(place);
  REQUIRE(place.run("formulas construct --degree 5 --dimension 1 --output f.json").code == 0);
  const std::string good = place.read("f.json");
  CHECK(place.run("formulas verify f.json").code == 0);
  place.write("f.json", replaced(good, "0.33333333", "0.33333334"));
  check_refusal(place, "formulas verify f.json", 2, {"f.json", "word"});
  check_refusal(place, "formulas show ./f.json", 2, {"f.json", "word"});
  check_refusal(place, "filter benes --method klv --observations Y.csv --formula f.json", 2,
                {"f.json", "word"});
  place.write("f.json", good.substr(0, good.size() / 2));
  check_refusal(place, "formulas verify f.json", 2, {"f.json", "line"});
}

TEST_CASE("a computation that fails says where and exits with 1") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n1,0.1\n2,0.1\n");
  place.write("m.toml", replaced(toml, "\"-x\"", "\"x^3\""));
  check_refusal(place, "filter m.toml --observations Y.csv", 1, {"step", "state x"});
  place.write("m.toml",
              replaced(replaced(toml, "\"-x\"", "\"-10\""), "initial = 1.0", "initial = 1.0, lower = 0.0"));
  check_refusal(place, "simulate m.toml --horizon 1 --steps 100 --observations Z.csv", 1,
                {"state x", "bounds"});
  check_refusal(place, "filter m.toml --observations Y.csv", 1, {"state x", "bounds"});
}

TEST_CASE("a plot without gnuplot is refused before anything is computed") {
  Workplace place;
  cli::simulate_benes(place);
  place.environment["PATH"] = place.directory().string();
  check_refusal(place, "filter benes --method klv --observations Y.csv --plot p.svg", 2,
                {"--plot", "gnuplot", "PATH"});
}

TEST_CASE("bundled data that is not there is named") {
  Workplace place;
  place.environment["WIENERTREE_DATA"] = "/no/such/directory";
  check_refusal(place, "model list", 2, {"WIENERTREE_DATA", "/no/such/directory"});
  // A model of one's own that an exact filter solves, or particles, need no formula.
  place.write("mine.toml",
              "name = \"mine\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\n[drift]\nx = "
              "\"-x\"\n[diffusion]\nx = [1]\n"
              "[observation]\nkind = \"continuous\"\nh = [\"x\"]\n");
  place.write("mine.csv", "t,y1\n0,0\n1,0.5\n2,0.25\n");
  CHECK(place.run("filter mine.toml --observations mine.csv").code == 0);
  CHECK(place.run("filter mine.toml --observations mine.csv --method euler --nodes 100").code == 0);
  check_refusal(place, "filter mine.toml --observations mine.csv --method klv", 2, {"WIENERTREE_DATA"});
}
