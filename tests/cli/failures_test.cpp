/// Every way in which a computation fails is told with step, time, node and state, or with the observation.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "program.hpp"

using namespace cli;

namespace {

struct Coefficients {
  std::string start, drift, diffusion, sensor;
};

void write_model(const Workplace& place, const Coefficients& c) {
  place.write("m.toml", "name = \"m\"\nconvention = \"ito\"\n[state]\nx = { " + c.start +
                            " }\n[drift]\nx = \"" + c.drift + "\"\n[diffusion]\nx = [\"" + c.diffusion +
                            "\"]\n[observation]\nkind = \"continuous\"\nh = [\"" + c.sensor + "\"]\n");
}

void check_failure(const Workplace& place, const std::string& arguments, int code,
                   const std::vector<std::string>& told) {
  const std::vector<std::string> before = place.files();
  const Outcome outcome = place.run(arguments);
  INFO(arguments << "\n" << outcome.err);
  CHECK(outcome.code == code);
  CHECK(outcome.out.empty());
  CHECK(lines_of(outcome.err).size() == 1);
  for (const std::string& part : told) CHECK_THAT(outcome.err, Catch::Contains(part));
  CHECK(place.files() == before);
}

}  // namespace

TEST_CASE("a node that cannot be moved is named with step, time, state, value and the solver's own words") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n0.1,0.1\n0.2,0.1\n0.3,0.1\n");
  const std::string filter = "filter m.toml --observations Y.csv --output out.csv ";
  // x' = x^3 from 3 explodes at t = 1/18; with x' = x - 1 and no noise to speak of the lower bound is left.
  write_model(place, {"initial = 3.0", "x^3", "1", "x"});
  for (const char* flow : {"--flow explicit", "--flow cvode"})
    check_failure(
        place, filter + flow, 1,
        {"step 1, t = 0.1, node 0, state x", "could not be solved to tolerance", "h = ", "nodes failed"});
  write_model(place, {"initial = 0.5, lower = 0.0", "-4", "0.1", "x"});
  for (const char* method : {"", "--flow cvode", "--method euler", "--method gaussian-mixture"})
    check_failure(place, filter + method, 1,
                  {"step ", "t = 0.", "state x", "left the state's bounds", "(-0."});
  write_model(place, {"initial = 1.0", "-5", "sqrt(x)", "x"});
  for (const char* method : {"--method euler", "--method gaussian-mixture"})
    check_failure(place, filter + method, 1, {"step 2, t = 0.2, particle", "state x", "not finite"});
  check_failure(place, filter + "--method grid", 1, {"step", "t = ", "not finite", "x = "});
}

TEST_CASE("a coefficient that is not finite at the start is bad input, named with its place in the file") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n1,0.1\n");
  const std::string filter = "filter m.toml --observations Y.csv";
  write_model(place, {"initial = 0.0", "1/x", "1", "x"});
  check_failure(place, filter, 2, {"m.toml:6:6, drift.x", "not finite at the start", "(inf)"});
  write_model(place, {"initial = 0.0", "1", "log(x-1)", "x"});
  check_failure(place, filter, 2, {"m.toml:8:7, diffusion.x[1]", "not finite at the start", "nan"});
  write_model(place, {"initial = 1.0", "1", "1", "log(-x)"});
  check_failure(place, filter, 2, {"m.toml:11:7, observation.h[1]", "not finite at the start", "nan"});
}

TEST_CASE("weights that are all zero are an error that names step, time and observation") {
  const Workplace place;
  place.write(
      "m.toml",
      "name = \"m\"\nconvention = \"ito\"\n[state]\nx = { initial = 0 }\n[drift]\nx = \"-x\"\n[diffusion]\nx "
      "= [0.1]\n[observation]\nkind = \"discrete\"\nlog_likelihood = \"log(max(0, 1-(y1-x)^2))\"\n");
  place.write("Y.csv", "t,y1\n0,0\n1,0.1\n2,50\n3,0\n");
  for (const char* method : {"--nodes 100000", "", "--thin tbba", "--thin levelwise", "--method euler",
                             "--method gaussian-mixture", "--method grid"})
    check_failure(place,
                  std::string("filter m.toml --observations Y.csv --steps 6 --output out.csv ") + method, 1,
                  {"step ", "t = 2, observation 50: "});
}

TEST_CASE("nodes are dropped only if asked, and never without a word") {
  const Workplace place;
  place.write("Y.csv", "t,y1\n0,0\n0.5,0.1\n1,0.1\n1.5,0.1\n");
  write_model(place, {"initial = 0.4, lower = 0.0", "0", "0.3", "x"});
  const std::string filter = "filter m.toml --observations Y.csv --output out.csv ";
  check_failure(place, filter, 1, {"node", "left the state's bounds"});
  const Outcome told = place.run(filter + "--on-node-failure drop");
  CHECK(told.code == 0);
  CHECK_THAT(told.err, Catch::Contains("on-node-failure drop") && Catch::Contains(" nodes dropped"));
  const Outcome quiet = place.run(filter + "--on-node-failure drop --quiet --format json");
  CHECK(quiet.code == 0);
  const auto dropped = nlohmann::json::parse(place.read("out.csv"))["dropped_nodes"].get<int>();
  CHECK(dropped > 0);
  CHECK(quiet.err.starts_with("wienertree: " + std::to_string(dropped) + " of "));
  // A law without the part below zero: no more evidence than with all.
  write_model(place, {"initial = 0.4", "0", "0.3", "x"});
  CHECK(Columns(output_of(place, "filter m.toml --observations Y.csv --quiet"))["log_evidence"].back() >
        nlohmann::json::parse(place.read("out.csv"))["rows"].back()["log_evidence"].get<double>());
  // Where none is left there is nothing to go on with.
  write_model(place, {"initial = 3.0", "x^3", "1", "x"});
  check_failure(place, "filter m.toml --observations Y.csv --on-node-failure drop --output o.csv", 1,
                {"step 1, t = 0.5, node 0", "(3 nodes failed)"});
}

TEST_CASE("a file that cannot be read is one line") {
  const Workplace place;
  simulate_benes(place);
  check_failure(place, "filter benes --method klv --observations /proc/self/mem", 2,
                {"/proc/self/mem", "cannot be read"});
  check_failure(place, "filter benes --method klv --observations Y.csv --plot p.svg --signal /proc/self/mem",
                2, {"/proc/self/mem"});
  check_failure(place, "filter ./m.toml --observations Y.csv", 2, {"m.toml"});
  Workplace directory;
  directory.input_from = "/";
  check_failure(directory, "filter benes --method klv -", 2, {"standard input:1", "reading failed"});
}
