/// What would take more memory, time or stack than there is, or give numbers that doubles do not hold, is refused before
/// it is begun.
#include <catch2/catch.hpp>
#include <chrono>

#include "program.hpp"

using namespace cli;

namespace {

const std::string model = R"(name = "m"
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

// One line, quickly, with nothing left behind.
void check_refusal(const Workplace& place, const std::string& arguments, int code,
                   const std::vector<std::string>& told) {
  const std::vector<std::string> before = place.files();
  const auto began = std::chrono::steady_clock::now();
  const Outcome outcome = place.run(arguments);
  INFO(arguments << "\n" << outcome.err);
  CHECK(outcome.signal == 0);
  CHECK(outcome.code == code);
  CHECK(lines_of(outcome.err).size() == 1);
  for (const std::string& part : told) CHECK_THAT(outcome.err, Catch::Contains(part));
  CHECK(place.files() == before);
  CHECK(std::chrono::steady_clock::now() - began < std::chrono::seconds(60));
}

}  // namespace

TEST_CASE("memory is estimated before it is taken, and --memory is the limit") {
  Workplace place;
  place.write("m.toml", model);
  place.write("d.toml", replaced(model, "kind = \"continuous\"",
                                 "kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1.0 }"));
  place.write("Y.csv", "t,y1\n0,0\n0.1,0.1\n0.2,0.1\n");
  const std::string filter = "filter m.toml --observations Y.csv --memory 1e9 ";
  for (const char* method : {"", "--thin tbba ", "--thin levelwise ", "--method euler ",
                             "--method gaussian-mixture ", "--method grid "})
    check_refusal(place, filter + method + "--nodes 1000000000", 2,
                  {"--nodes", "1000000000", "of memory, over the limit of 1 GB"});
  check_refusal(place, filter + "--method euler --nodes 1000000 --launches 100", 2,
                {"100 launches", "over the limit"});
  check_refusal(place, "filter d.toml --observations Y.csv --memory 1e9 --steps 1000000000", 2,
                {"--steps", "a record cut into 1000000000 steps"});
  check_refusal(place, "simulate m.toml --horizon 1 --steps 1000000000 --memory 1e9 --observations Z.csv", 2,
                {"--keep", "a simulation of 1000000000 rows"});
  check_refusal(place, "weak m.toml --payoff x --horizon 1 --steps 4 --nodes 1000000000 --memory 1e9", 2,
                {"over the limit"});
  check_refusal(place, "compare ./m.toml m.toml --observations Y.csv --nodes 1000000000 --memory 1e9", 2, {});
  for (const char* value : {"0", "-1", "nan", "x", ""})
    check_refusal(place, filter + "--memory=" + value, 2, {});
  // The same run passes under its own estimate, and not under less.
  CHECK(place.run("filter m.toml --observations Y.csv --method euler --nodes 100000 --memory 20e6 --quiet")
            .code == 0);
  check_refusal(place,
                "filter m.toml --observations Y.csv --method euler --nodes 100000 --memory 2e6 --quiet", 2,
                {"8 MB", "2 MB"});
}

TEST_CASE("inputs without an end are refused by their size") {
  Workplace place;
  place.write("m.toml", model);
  place.write("Y.csv", "t,y1\n0,0\n0.1,0.1\n");
  for (const char* command :
       {"filter m.toml --observations /dev/zero", "model show /dev/zero", "formulas verify /dev/zero",
        "study /dev/zero --output out", "filter m.toml --observations Y.csv --resume /dev/zero --memory 1e8",
        "filter m.toml --observations Y.csv --signal /dev/zero --plot p.svg"})
    check_refusal(place, command, 2, {"/dev/zero"});
  place.write("long.csv", "t,y1\n0," + std::string(2'000'000, '1') + "\n1,0\n");
  check_refusal(place, "filter m.toml --observations long.csv", 2,
                {"long.csv:2", "longer than 1048576 bytes"});
  place.input_from = "/dev/zero";
  check_refusal(place, "filter m.toml -", 2, {"standard input:1", "longer than"});
}

TEST_CASE("nesting is limited before a library meets it") {
  Workplace place;
  std::string dotted = "a";
  for (int i = 1; i < 40000; ++i) dotted += ".a";
  const std::string study = "title = \"s\"\n";
  for (const std::string& text :
       {"[" + dotted + "]\nb = 1\n", dotted + " = 1\n", "a = { " + dotted + " = 1 }\n",
        "[[" + dotted + "]]\n", "a = [{ b = { " + dotted + " = 1 } }]\n"}) {
    place.write("deep.toml", model + text);
    check_refusal(place, "model show deep.toml", 2, {"deep.toml:12", "more than 32 parts"});
    check_refusal(place, "study ./deep.toml --output out", 2, {"deep.toml:12", "more than 32 parts"});
  }
  const std::string open(100'000, '['), closed(100'000, ']');
  place.write("deep.toml", model + "a = " + open + closed + "\n");
  check_refusal(place, "model show deep.toml", 2, {"deep.toml:12", "deeper than 32 levels"});
  place.write("deep.json", "{\"name\": " + open + closed + "}");
  check_refusal(place, "formulas verify deep.json", 2, {"nested too deeply"});
  // Dots and brackets in strings and comments are no nesting.
  place.write("m.toml", "# [[[" + dotted + "\n" +
                            replaced(model, "\"m\"", "\"" + dotted + " [[[{{{ \\\" \"") + "[exact]\n");
  const Outcome outcome = place.run("model show m.toml");
  CHECK_THAT(outcome.err, !Catch::Contains("parts") && !Catch::Contains("deeper"));
}

TEST_CASE("derivatives that would grow beyond measure are refused with what grew") {
  const Workplace place;
  std::string product = "cos(x)";
  for (int k = 2; k <= 150; ++k) product += "*cos(" + std::to_string(k) + "*x)";
  place.write("m.toml", replaced(model, "[\"1\"]", "[\"" + product + "\"]"));
  check_refusal(place, "model show m.toml", 2, {"m.toml", "derivative by x", "over the limit"});
  std::string states, drift, diffusion;
  for (int i = 0; i < 2000; ++i) {
    const std::string name = "x" + std::to_string(i);
    states += name + " = { initial = 1.0 }\n";
    drift += name + " = \"-" + name + "\"\n";
    diffusion += name + " = [\"1\"]\n";
  }
  place.write("wide.toml", "name = \"w\"\nconvention = \"ito\"\n[state]\n" + states + "[drift]\n" + drift +
                               "[diffusion]\n" + diffusion);
  check_refusal(place, "model show wide.toml", 2, {"2000 states and 1 Brownian motions", "8e+06 entries"});
}

TEST_CASE("numbers that doubles do not hold are refused with place and value") {
  const Workplace place;
  place.write("m.toml", model);
  const std::string simulate = "simulate m.toml --steps 10 --observations - --horizon ";
  check_refusal(place, simulate + "1e-310", 2, {"horizon", "cannot be represented"});
  check_refusal(place, simulate + "1.7e308", 2, {"horizon", "cannot be represented"});
  place.write("sensor.toml", replaced(model, "h = [\"x\"]", "h = [\"1e308*(1+x)*10*x\"]"));
  check_refusal(place, "simulate sensor.toml --steps 10 --horizon 100 --observations -", 2, {});
  place.write("Y.csv", "t,y1\n0,-1.7e308\n1,1.7e308\n");
  for (const char* method : {"kalman-bucy", "klv", "euler", "grid"})
    check_refusal(place, std::string("filter m.toml --observations Y.csv --method ") + method, 1, {});
  place.write("far.csv", "t,y1\n-1.7e308,0\n1.7e308,1\n");
  check_refusal(place, "filter m.toml --observations far.csv", 2, {"row 2", "further apart than a double"});
  check_refusal(place, "weak m.toml --payoff x --horizon 1 --steps 8 --grid kusuoka --gamma 1e300", 2,
                {"gamma", "are equal in doubles"});
  // Atoms nearer to each other than the smallest normal number: no crash, and bounds that hold.
  place.write("near.csv", "t,y1\n0,0\n5e-324,0.1\n");
  for (const char* method : {"klv", "euler", "gaussian-mixture"}) {
    const Outcome outcome =
        place.run(std::string("filter m.toml --observations near.csv --quiet --method ") + method);
    CHECK(outcome.signal == 0);
    CHECK((outcome.code >= 0 && outcome.code <= 2));
  }
}

TEST_CASE("a study asks for times inside its record, and for runs that fit") {
  const Workplace place;
  place.write("m.toml", model);
  const std::string study =
      "title = \"s\"\ncommand = \"filter\"\nquantity = \"mean_x\"\nmeasure = \"absolute\"\nreference = "
      "\"exact\"\n[observations]\nhorizon = 1.0\nsteps = 100\n[options]\nmodel = \"./m.toml\"\nnodes = 10\n";
  for (const char* until : {"1.5", "-1.0"}) {
    place.write("s.toml", study + "until = " + until + "\n");
    const Outcome outcome = place.run("study ./s.toml --output out --quiet");
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::Contains("until") && Catch::Contains("within the record, 0 .. 1"));
  }
  place.write("s.toml", replaced(study, "steps = 100", "steps = 10000000000"));
  CHECK_THAT(place.run("study ./s.toml --output out --quiet").err, Catch::Contains("1000000000"));
  place.write("s.toml", replaced(study, "steps = 100", "steps = 1000000\npaths = 100000"));
  CHECK_THAT(place.run("study ./s.toml --output out --quiet --memory 1e9").err,
             Catch::Contains("100000 simulated records of 1000000 rows") &&
                 Catch::Contains("over the limit of 1 GB"));
}

TEST_CASE("a last row that was cut off is refused, a whole one without its end is read") {
  const Workplace place;
  place.write("m.toml", replaced(model, "kind = \"continuous\"",
                                 "kind = \"discrete\"\nnoise = { law = \"gaussian\", sd = 1.0 }"));
  const std::string rows = "t,y1\n0,0\n0.1,0.05\n";
  for (const char* field : {"0.", "1e", "1E", "1e+", "-", ""}) {
    place.write("Y.csv", rows + "0.2," + field);
    check_refusal(place, "filter m.toml --observations Y.csv", 2, {"Y.csv:4: column y1", "cut off"});
  }
  for (const char* row : {"0.2,0.25", "0.2,1e3", "0.2,.5", "0.2,NA\n", "0.2,\n", "0.2,0.\n"}) {
    place.write("Y.csv", rows + row);
    const Outcome outcome = place.run("filter m.toml --observations Y.csv --quiet");
    INFO(row << outcome.err);
    if (std::string(row).find("NA") == std::string::npos) CHECK(outcome.code == 0);
  }
}
