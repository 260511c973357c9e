/// What `filter` tells: its table, its summary, its JSON, and that the same command gives the same bytes.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.hpp"

using cli::Columns;
using cli::Outcome;
using cli::Workplace;

namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
  return text;
}

}  // namespace

TEST_CASE("simulate writes observations and signal, the same for the same seed") {
  const Workplace place;
  cli::simulate_benes(place);
  const Columns y(place.read("Y.csv")), x(place.read("X.csv"));
  CHECK(joined(y.names()) == "t,y1");
  CHECK(joined(x.names()) == "t,x");
  CHECK(y.rows() == 401);
  CHECK(x["t"] == y["t"]);
  CHECK(y["t"].front() == 0);
  CHECK(y["t"].back() == 4);
  CHECK(y["y1"].front() == 0);
  const std::string same =
      output_of(place, "simulate benes --horizon 4 --steps 4000 --keep 400 --seed 3 --observations -");
  CHECK(same == place.read("Y.csv"));
  CHECK(same !=
        output_of(place, "simulate benes --horizon 4 --steps 4000 --keep 400 --seed 4 --observations -"));
  const Columns lorenz(output_of(place, "simulate lorenz63 --horizon 1 --steps 50 --signal -"));
  CHECK(joined(lorenz.names()) == "t,x,y,z");
  CHECK(lorenz.rows() == 51);
}

TEST_CASE("filter writes a row a step with the columns of the interface") {
  const Workplace place;
  cli::simulate_benes(place);
  const Columns table(
      output_of(place, "filter benes --method klv --observations Y.csv --steps 80 --moments 3"));
  CHECK(joined(table.names()) == "t,mean_x,sd_x,q05_x,q50_x,q95_x,log_evidence,nodes,ess,m2_x,m3_x");
  REQUIRE(table.rows() == 81);
  CHECK(table["t"].front() == 0);
  CHECK(table["mean_x"].front() == 0);
  CHECK(table["log_evidence"].front() == 0);
  CHECK(table["t"].back() == 4);
  const Columns exact(output_of(place, "filter benes --observations Y.csv --steps 80 --method benes"));
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const double mean = table["mean_x"][r], sd = table["sd_x"][r];
    CHECK(table["m2_x"][r] == Approx(mean * mean + sd * sd).margin(1e-12));
    CHECK(table["q05_x"][r] <= table["q50_x"][r]);
    CHECK(table["q50_x"][r] <= table["q95_x"][r]);
    CHECK(table["t"][r] == exact["t"][r]);
    // 80 steps of the second-order filter: errors are about 1e-4 (docs/benchmarks.md); 5e-3 tells a wrong
    // filter apart.
    CHECK(mean == Approx(exact["mean_x"][r]).margin(5e-3));
    CHECK(sd == Approx(exact["sd_x"][r]).margin(5e-3));
    CHECK(table["log_evidence"][r] == Approx(exact["log_evidence"][r]).margin(5e-3));
  }
}

TEST_CASE("the summary for people goes to standard error, and --quiet keeps it back") {
  const Workplace place;
  cli::simulate_benes(place);
  const Outcome told = place.run("filter benes --method klv --observations Y.csv --output out.csv");
  CHECK(told.out.empty());
  for (const char* part : {"KLV filter", "benes", "401 rows", "200 steps", "functional second-order",
                           "posterior at t = 4", "mean", "exact", "difference", "log evidence", "ODE solves"})
    CHECK_THAT(told.err, Catch::Contains(part));
  CHECK(Columns(place.read("out.csv")).rows() == 201);
  const Outcome quiet = place.run("filter benes --method klv --observations Y.csv --quiet");
  CHECK(quiet.err.empty());
  CHECK(quiet.out == place.read("out.csv"));
}

TEST_CASE("JSON has the table's fields, every option in force and the version") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter =
      "filter benes --observations Y.csv --steps 40 --thin tbba --nodes 50 --seed 9 --set mu=0.1 --moments "
      "2 ";
  const auto json = nlohmann::json::parse(output_of(place, filter + "--format json"));
  const Columns table(output_of(place, filter));
  CHECK(place.run("--version").out == "wienertree " + json["version"].get<std::string>() + "\n");
  CHECK(json["model"] == "benes");
  CHECK(json["parameters"]["mu"] == 0.1);
  CHECK(json["observations"] == "Y.csv");
  const auto& options = json["options"];
  CHECK(options["method"] == "klv");
  CHECK(options["degree"] == 5);
  CHECK(options["nodes"] == 50);
  CHECK(options["steps"] == 40);
  CHECK(options["thin"] == "tbba");
  CHECK(options["order"] == "spatial");
  CHECK(options["prune-weights"] == "likelihood");
  CHECK(options["functional"] == "second-order");
  CHECK(options["seed"] == 9);
  CHECK(options["launches"] == 1);
  CHECK(options["moments"] == 2);
  REQUIRE(json["rows"].size() == table.rows());
  for (std::size_t r = 0; r < table.rows(); ++r) {
    CHECK(json["rows"][r].size() == table.names().size());
    for (const std::string& name : table.names())
      CHECK(json["rows"][r][name].get<double>() == table[name][r]);
  }
}

TEST_CASE("the same command gives the same bytes, for any number of threads") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter =
      "filter benes --observations Y.csv --steps 40 --quiet --thin tbba --nodes 3000 --launches 2 ";
  for (const char* format : {"--format csv", "--format json"}) {
    const std::string once = output_of(place, filter + format + " --threads 1");
    CHECK(once == output_of(place, filter + format + " --threads 1"));
    CHECK(once == output_of(place, filter + format + " --threads 3"));
    CHECK(once != output_of(place, filter + format + " --seed 2"));
  }
}

TEST_CASE("every value of every option works and agrees with the exact filter") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter = "filter benes --observations Y.csv --steps 50 --quiet ";
  const Columns exact(output_of(place, filter + "--method benes"));
  // The spread of the posterior mean is about 0.8; first-order functionals and random thinning are far better
  // than 0.25; weights carried along degenerate (log-evidence has sd 0.15 with 1000 nodes) and get more.
  for (const char* options :
       {"--thin tbba",
        "--thin tbba --order tree",
        "--thin multinomial",
        "--thin residual",
        "--thin stratified",
        "--thin systematic",
        "--thin recombination",
        "--thin recombination --recombination-degree 7 --nodes 40",
        "--thin none --steps 8",
        "--method full-tree --steps 8",
        "--method euler",
        "--method euler --ess-threshold 0.5 --thin tbba",
        "--method euler --thin none",
        "--method gaussian-mixture --nodes 5000",
        "--method gaussian-mixture --nodes 5000 --alpha 0.2 --beta 0.01 --thin multinomial",
        "--functional picard",
        "--functional trapezoid",
        "--functional second-order",
        "--prune-weights cubature --nodes 20000",
        "--prune-weights likelihood",
        "--flow auto",
        "--flow explicit",
        "--flow cvode",
        "--flow cvode --rtol 1e-6 --atol 1e-8",
        "--degree 3",
        "--degree 7",
        "--formula lyons-victoir-5-1",
        "--on-node-failure drop",
        "--on-node-failure stop"}) {
    INFO(options);
    const auto gives = [&](const char* option) {
      return std::string(options).find(option) != std::string::npos;
    };
    std::string command = "filter benes --observations Y.csv --quiet ";
    if (!gives("--method")) command += "--method klv ";
    if (!gives("--steps")) command += "--steps 50 ";
    const Columns table(output_of(place, command + options));
    CHECK(table["mean_x"].back() == Approx(exact["mean_x"].back()).margin(0.25));
    CHECK(table["log_evidence"].back() == Approx(exact["log_evidence"].back()).margin(0.25));
  }
  output_of(place, "simulate ornstein-uhlenbeck --horizon 1 --steps 100 --observations OU.csv");
  const Columns by_exact(
      output_of(place, "filter ornstein-uhlenbeck --method klv --observations OU.csv --flow exact"));
  const Columns by_cvode(
      output_of(place, "filter ornstein-uhlenbeck --method klv --observations OU.csv --flow cvode"));
  CHECK(by_exact["mean_x"].back() == Approx(by_cvode["mean_x"].back()).margin(1e-6));
}

TEST_CASE("launches are averaged and their spread is told") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter = "filter benes --observations Y.csv --steps 40 --thin multinomial --nodes 200 ";
  const Columns several(output_of(place, filter + "--launches 8"));
  CHECK(several.has("mc_sd_x"));
  CHECK(several.has("mc_sd_log_evidence"));
  CHECK(several["mc_sd_x"].front() == 0);
  // The standard error of the mean of 200 particles with sd 0.8 is 0.06; ten times less or more is a mistake.
  CHECK(several["mc_sd_x"].back() > 0.006);
  CHECK(several["mc_sd_x"].back() < 0.6);
  CHECK_FALSE(Columns(output_of(place, filter)).has("mc_sd_x"));
  CHECK_THAT(place.run(filter + "--launches 8 --output o.csv").err, Catch::Contains("sd over launches"));
}

TEST_CASE("standard input is filtered row by row, with the same numbers as a file") {
  Workplace place;
  cli::simulate_benes(place);
  place.input = place.read("Y.csv");
  const std::string streamed = output_of(place, "filter benes --method klv --observations - --quiet");
  CHECK(streamed == output_of(place, "filter benes --method klv --observations Y.csv --steps 400 --quiet"));
  const std::filesystem::path nile =
      std::filesystem::path(WIENERTREE_SOURCE_DIR) / "data/observations/nile.csv";
  place.input = place.read(nile.string());
  CHECK(output_of(place, "filter nile --method klv --observations - --quiet") ==
        output_of(place, "filter nile --method klv --observations " + nile.string() + " --quiet"));
  // A bad row ends the run; what was told before it was told in time.
  place.input = "t,y1\n0,0\n0.1,0.1\n0.2,nan\n";
  const Outcome outcome = place.run("filter benes --method klv --observations - --quiet");
  CHECK(outcome.code == 2);
  CHECK_THAT(outcome.err, Catch::Contains("standard input:4"));
  CHECK(cli::lines_of(outcome.out).size() == 3);
}

TEST_CASE("filter reads standard input row by row and answers each row before the next") {
  const Workplace place;
  for (const char* command :
       {"filter benes --method klv --observations - --quiet", "filter benes - --quiet"}) {
    cli::Running filter = place.start(command, true);
    filter.tell("t,y1\n0,0\n");
    CHECK_THAT(filter.read_line(), Catch::StartsWith("t,mean_x"));
    CHECK_THAT(filter.read_line(), Catch::StartsWith("0,"));
    filter.tell("0.5,0.25\n");
    CHECK_THAT(filter.read_line(), Catch::StartsWith("0.5,"));
    filter.tell("1,");
    filter.tell("0.5\n");
    CHECK_THAT(filter.read_line(), Catch::StartsWith("1,"));
    filter.end_input();
    CHECK(filter.read_line().empty());
    CHECK(filter.finish().code == 0);
  }
}

TEST_CASE("discrete observations: the Nile against the published Kalman filter") {
  const Workplace place;
  const std::string nile = std::string(WIENERTREE_SOURCE_DIR) + "/data/observations/nile.csv";
  const Columns table(output_of(place, "filter nile --method klv --observations " + nile));
  // Durbin, Koopman (2012), section 2.2: log-likelihood -641.585578, mean and variance in 1970: 798.36911,
  // 4032.08089.
  CHECK(table["t"].back() == 1970);
  CHECK(table["log_evidence"].back() == Approx(-641.585578).margin(0.01));
  CHECK(table["mean_level"].back() == Approx(798.36911).margin(0.5));
  CHECK(table["sd_level"].back() == Approx(std::sqrt(4032.08089)).margin(0.5));
}
