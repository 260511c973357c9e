/// A study writes only to a directory of its own, takes a run on disk only for what it is, and knows before the first
/// run what cannot come of it.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "program.hpp"

using namespace cli;

namespace {

namespace fs = std::filesystem;

const std::string model =
    "convention = \"ito\"\n[parameters]\nmu = 0.5\n[state]\nx = { initial = 1.0 }\n[drift]\nx = "
    "\"-mu*x\"\n[diffusion]\nx = [\"1\"]\n[observation]\nkind = \"continuous\"\nh = [\"x\"]\n[exact]\nfilter "
    "= "
    "\"kalman-bucy\"\n";

std::string study_with(const std::string& top, const std::string& series) {
  return "title = \"s\"\n" + top +
         "[observations]\nhorizon = 1\nsteps = 100\nkeep = 20\n[options]\nmodel = \"m.toml\"\n" +
         "nodes = 10\n" + series;
}

const std::string small = study_with("reference = \"exact\"\n", "steps = [5, 10]\n");

Outcome run_study(const Workplace& place, const std::string& directory = "out") {
  return place.run("study s.toml --quiet --output " + directory);
}

void check_refused(const Workplace& place, const std::string& directory,
                   const std::vector<std::string>& told) {
  const Outcome outcome = run_study(place, directory);
  INFO(outcome.err);
  CHECK(outcome.code == 2);
  CHECK(lines_of(outcome.err).size() == 1);
  for (const std::string& part : told) CHECK_THAT(outcome.err, Catch::Contains(part));
}

// Of a summary "  12 runs, 4 of them computed now".
std::string computed(const Outcome& outcome) {
  for (const std::string& line : lines_of(outcome.err))
    if (line.ends_with("computed now")) return line.substr(line.find_first_not_of(' '));
  return outcome.err;
}

// The formula of degree 7 in `file` as one of degree 5 with another name.
std::string named_degree_5(const std::string& file, const std::string& name) {
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string old = "{\"name\": \"moment-equations-7-1\", \"degree\": 7";
  REQUIRE(text.starts_with(old));
  return "{\"name\": \"" + name + "\", \"degree\": 5" + text.substr(old.size());
}

}  // namespace

TEST_CASE("a directory that somebody else filled is refused before anything is written") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("s.toml", small);
  for (const std::string name : {"runs.csv", "index.html", "table.csv", "notes.txt", "problem.json"}) {
    fs::create_directory(place.directory() / "out");
    place.write("out/" + name, "precious\n");
    check_refused(place, "out", {"is not empty, and no study made it"});
    CHECK(place.read("out/" + name) == "precious\n");
    CHECK(std::distance(fs::directory_iterator(place.directory() / "out"), {}) == 1);
    fs::remove_all(place.directory() / "out");
  }
  place.write("out", "a file\n");
  check_refused(place, "out", {"no directory can be made there"});
  fs::remove(place.directory() / "out");
  fs::create_directory(place.directory() / "out");  // empty
  CHECK(run_study(place).code == 0);
  place.write("out/wienertree-study.json", "{\"program\": 3}");
  check_refused(place, "out", {"is not what a study left there"});
}

TEST_CASE("links in a directory are not followed to files elsewhere") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("s.toml", small);
  REQUIRE(run_study(place).code == 0);
  for (const std::string name :
       {"runs.csv", "index.html", "table.csv", "slopes.csv", "wienertree-study.json"}) {
    const fs::path file = place.directory() / "out" / name, foreign = place.directory() / "precious";
    const std::string before = place.read("out/" + name);
    place.write("precious", name == "wienertree-study.json" ? before : "precious\n");
    const std::string precious = place.read("precious");
    fs::remove(file);
    fs::create_symlink(foreign, file);
    check_refused(place, "out", {name, "is a link"});
    fs::remove(file);
    fs::create_hard_link(foreign, file);
    check_refused(place, "out", {name, "is a hard link"});
    CHECK(place.read("precious") == precious);
    fs::remove(file);
    place.write("out/" + name, before);
  }
  CHECK(run_study(place).code == 0);
}

TEST_CASE("a directory belongs to one study, whose inputs it does not overwrite") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("s.toml", small);
  place.write("other.toml", small);
  REQUIRE(run_study(place).code == 0);
  const std::string page = place.read("out/index.html");
  const Outcome other = place.run("study other.toml --quiet --output out");
  CHECK(other.code == 2);
  CHECK_THAT(other.err, Catch::Contains("belongs to the study s, and this is other"));
  CHECK(place.read("out/index.html") == page);
  // An input inside its own directory.
  place.write("Y.csv", "t,y1\n0,0\n0.5,0.1\n1,0.2\n");
  fs::rename(place.directory() / "Y.csv", place.directory() / "out" / "table.csv");
  place.write(
      "s.toml",
      "title = \"s\"\nreference = \"exact\"\n[observations]\nfile = \"out/table.csv\"\n[options]\nmodel = "
      "\"m.toml\"\nnodes = 10\n");
  check_refused(place, "out", {"table.csv", "it would be overwritten"});
}

TEST_CASE(
    "runs on disk are taken only where everything that decides them is the same, and the others are kept") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("other.toml", model);
  REQUIRE(place.run("formulas construct --degree 5 --dimension 1 --output f.json").code == 0);
  REQUIRE(place.run("formulas construct --degree 3 --dimension 1 --output f3.json").code == 0);
  const auto study = [](const std::string& horizon, const std::string& reference_nodes) {
    return "title = \"s\"\n[reference.run]\nformula = \"r.json\"\nnodes = " + reference_nodes +
           "\n[observations]\nhorizon = " + horizon +
           "\nsteps = 100\nkeep = 20\n[options]\nnodes = 10\nsteps = 5\n[[series]]\nlabel = "
           "\"formula\"\nmodel = "
           "\"m.toml\"\nformula = \"f.json\"\n[[series]]\nlabel = \"degree\"\nmodel = \"other.toml\"\ndegree "
           "= [3, 5]\n";
  };
  place.write("r.json", place.read("f.json"));
  place.write("s.toml", study("1", "20"));
  const auto run = [&] { return computed(place.run("study s.toml --output out")); };
  CHECK(run() == "3 runs, 3 of them computed now");
  CHECK(run() == "3 runs, 0 of them computed now");
  // A formula that one cell uses.
  const std::string formula = place.read("f.json");
  place.write("f.json", place.read("f3.json"));
  CHECK(run() == "3 runs, 1 of them computed now");
  place.write("f.json", formula);
  CHECK(run() == "3 runs, 0 of them computed now");  // its earlier run was kept
  // Another one of the same name and degree: a formula of degree 7 is one of degree 5 as well.
  place.write("f.json",
              named_degree_5(WIENERTREE_SOURCE_DIR "/data/cubature_formulas/moment-equations-7-1.json",
                             "lyons-victoir-5-1"));
  CHECK(run() == "3 runs, 1 of them computed now");
  place.write("f.json", formula);
  // A model that two cells use; then back.
  place.write("other.toml", model + "# changed\n");
  CHECK(run() == "3 runs, 2 of them computed now");
  place.write("other.toml", model);
  CHECK(run() == "3 runs, 0 of them computed now");
  // The reference: its formula, its options. The record.
  place.write("r.json", place.read("f3.json"));
  CHECK(run() == "3 runs, 3 of them computed now");
  place.write("s.toml", study("1", "30"));
  CHECK(run() == "3 runs, 3 of them computed now");
  place.write("s.toml", study("2", "30"));
  CHECK(run() == "3 runs, 3 of them computed now");
  place.write("r.json", formula);
  place.write("s.toml", study("1", "20") + "[[plot]]\nx = \"nodes\"\ntitle = \"new\"\n");
  CHECK(run() == "3 runs, 0 of them computed now");
  // Bundled formulas of another version.
  Workplace elsewhere;
  fs::copy(place.directory(), elsewhere.directory(), fs::copy_options::recursive);
  fs::copy(WIENERTREE_SOURCE_DIR "/data", elsewhere.directory() / "data", fs::copy_options::recursive);
  elsewhere.environment["WIENERTREE_DATA"] = (elsewhere.directory() / "data").string();
  CHECK(computed(elsewhere.run("study s.toml --output out")) == "3 runs, 0 of them computed now");
}

TEST_CASE("a record in a file that changes is another record") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("Y.csv", "t,y1\n0,0\n0.5,0.1\n1,0.2\n");
  place.write("s.toml",
              "title = \"s\"\nreference = \"exact\"\n[observations]\nfile = \"Y.csv\"\n[options]\nmodel = "
              "\"m.toml\"\nnodes = [10, 20]\n");
  CHECK(computed(place.run("study s.toml --output out")) == "2 runs, 2 of them computed now");
  CHECK(computed(place.run("study s.toml --output out")) == "2 runs, 0 of them computed now");
  place.write("Y.csv", "t,y1\n0,0\n0.5,0.1\n1,0.3\n");
  CHECK(computed(place.run("study s.toml --output out")) == "2 runs, 2 of them computed now");
}

TEST_CASE("a series to which a measure does not apply is left out of it, with a note") {
  const Workplace place;
  place.write("m.toml", model);
  place.write(
      "s.toml",
      study_with("reference = \"exact\"\nmeasure = [\"deviation\", \"rmse\"]\nlaunches = 3\n",
                 "[[series]]\nlabel = \"drawn\"\nthin = \"tbba\"\nsteps = [5, 10]\n[[series]]\nlabel = "
                 "\"not drawn\"\nsteps = [5, 10]\n[[plot]]\nx = \"steps\"\n[[plot]]\nx = "
                 "\"steps\"\ny = \"rmse\"\n"));
  const Outcome outcome = place.run("study s.toml --output out");
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK_THAT(outcome.err, Catch::Contains("note: the series not drawn has no deviation of mean_x"));
  CHECK_THAT(place.read("out/index.html"),
             Catch::Contains("the series not drawn has no deviation of mean_x"));
  CHECK(lines_of(place.read("out/slopes.csv")).size() == 1 + 3);
  // Where it applies to no series there is nothing to run.
  place.write("s.toml", study_with("reference = \"exact\"\nmeasure = \"deviation\"\n", "steps = [5, 10]\n"));
  check_refused(place, "new", {"measure", "applies to no series", "at least two"});
  CHECK(!fs::exists(place.directory() / "new"));
}

TEST_CASE("what cannot come of a study is known before its first run") {
  const Workplace place;
  place.write("m.toml", model);
  const auto refused = [&](const std::string& top, const std::string& series,
                           const std::vector<std::string>& told) {
    place.write("s.toml", study_with(top, series));
    check_refused(place, "new", told);
    CHECK(!fs::exists(place.directory() / "new"));
  };
  const std::string exact = "reference = \"exact\"\n", steps = "steps = [5, 10]\n";
  refused("", steps, {"rmse", "there is no reference"});
  refused(exact, "set.mu = [-1.0, 0.5]\n[[plot]]\nx = \"set.mu\"\n",
          {"s.toml:", "set.mu has no place on a logarithmic axis", "log_x = false", "(-1)"});
  refused(exact, steps + "[[plot]]\nx = \"thin\"\n", {"an axis must be an option with numbers"});
  refused(exact,
          steps + "[[plot]]\nx = \"steps\"\n[[claim]]\ntext = \"c\"\nslope = \"none\"\nwithin = [0, 1]\n",
          {"no line of the plot has this label"});
  refused(
      exact,
      "steps = 5\n[[plot]]\nx = \"steps\"\n[[claim]]\ntext = \"c\"\nslope = \"mean_x\"\nwithin = [0, 1]\n",
      {"no slope is fitted"});
  refused(exact,
          steps +
              "[[plot]]\nx = \"steps\"\n[[claim]]\ntext = \"c\"\nratio = \"mean_x\"\nto = \"mean_x\"\nat = "
              "7\nwithin "
              "= [0, 1]\n",
          {"the line has no such point", "mean_x at 7"});
  refused("quantity = \"log_bayes_factor\"\nmeasure = \"value\"\n", steps, {"does not know it"});
}

TEST_CASE("values that are not positive do not break a logarithmic axis") {
  const Workplace place;
  place.write("m.toml", model);
  place.write("s.toml", study_with("measure = \"value\"\nquantity = \"log_evidence\"\n",
                                   "steps = [5, 10]\nset.mu = [0.5, 50.0]\n[[plot]]\nx = \"steps\"\n"));
  Outcome outcome = place.run("study s.toml --output out");
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(!place.read("out/plot-1.svg").empty());
  CHECK_THAT(outcome.err, Catch::Contains("positive"));
}

TEST_CASE("a payoff of several lines, with commas and quotes, is read back from the journal") {
  const Workplace place;
  place.write("s.toml",
              "title = \"s\"\ncommand = \"weak\"\nreference = 1\n[options]\nmodel = \"gbm\"\nhorizon = "
              "1\nsteps = [1, "
              "2]\npayoff = \"\"\"\nmax(s - 100,\n  0)\"\"\"\n");
  CHECK(computed(place.run("study s.toml --output out")) == "2 runs, 2 of them computed now");
  CHECK(lines_of(place.read("out/runs.csv")).size() == 3);
  CHECK(computed(place.run("study s.toml --output out")) == "2 runs, 0 of them computed now");
}

TEST_CASE("what a study shows as a command is safe to paste into a shell") {
  const Workplace place;
  place.write("a'$(touch PWNED)'.toml", model);
  place.write("s.toml",
              "title = \"s\"\nreference = \"exact\"\n[observations]\nhorizon = 1\nsteps = 100\nkeep = 20\n"
              "[options]\nmodel = \"a'$(touch PWNED)'.toml\"\nnodes = 10\nsteps = [5, 10]\n");
  REQUIRE(run_study(place).code == 0);
  CHECK_THAT(place.read("out/table.csv"), Catch::Contains("'a'\\''$(touch PWNED)'\\''.toml'"));
}
