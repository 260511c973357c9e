/// weak: payoffs averaged by the tree, added states, and what is refused.
#include <fmt/format.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.hpp"

using cli::Outcome;
using cli::Workplace;

namespace {

nlohmann::json rows_of(const Workplace& place, const std::string& arguments) {
  const Outcome outcome = place.run("weak " + arguments + " --quiet --format json");
  INFO(arguments << "\n" << outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.err.empty());
  return nlohmann::json::parse(outcome.out)["rows"];
}

double value_of(const Workplace& place, const std::string& arguments) {
  return rows_of(place, arguments)[0]["value"];
}

}  // namespace

TEST_CASE("weak: several payoffs from one tree, as CSV, as JSON, in a file") {
  const Workplace place;
  const std::string command = "weak gbm --horizon 1 --steps 4 --payoff s --payoff max(s-100,0) --discount r";
  const Outcome csv = place.run(command);
  REQUIRE(csv.code == 0);
  const auto lines = cli::lines_of(csv.out);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0] == "payoff,value,standard_error,nodes,ode_solves,seconds");
  CHECK_THAT(lines[1], Catch::StartsWith("s,"));
  CHECK_THAT(lines[2], Catch::StartsWith("\"max(s-100,0)\","));
  CHECK_THAT(csv.err, Catch::Contains("E[max(s-100,0)] = ") && Catch::Contains("ODE solves"));

  REQUIRE(place.run(command + " --format json --output o.json --richardson").code == 0);
  const auto json = nlohmann::json::parse(place.read("o.json"));
  CHECK(json["options"]["discount"] == "r");
  CHECK(json["options"]["steps"] == 4);
  CHECK(json["options"]["degree"] == 5);
  CHECK(json["rows"][1]["payoff"] == "max(s-100,0)");
  for (const char* key : {"value", "standard_error", "extrapolated", "nodes", "ode_solves", "seconds"})
    CHECK(json["rows"][0].contains(key));
  // A discounted martingale: the error of degree 5 with 4 steps is 4e-6, extrapolated 1e-8.
  CHECK(json["rows"][0]["value"].get<double>() == Approx(100).epsilon(1e-7));
  CHECK(json["rows"][0]["extrapolated"].get<double>() == Approx(100).epsilon(1e-9));
}

TEST_CASE("weak: averages and integrals are states") {
  const Workplace place;
  // E (1/T) int_0^T s dt = s_0 (e^{rT} - 1)/(rT).
  const double average = 100 * std::expm1(0.1) / 0.1;
  const std::string gbm = "gbm --horizon 2 --steps 8 --degree 7 ";
  CHECK(value_of(place, gbm + "--average s --payoff average_s") == Approx(average).epsilon(1e-8));
  CHECK(value_of(place, gbm + "--average mean=s/100 --payoff 100*mean") == Approx(average).epsilon(1e-8));
  CHECK(value_of(place, gbm + "--integral sum=s --payoff sum/2") == Approx(average).epsilon(1e-8));
}

TEST_CASE("weak: discounting along the path is a payoff of the integral, and a constant rate a factor") {
  const Workplace place;
  const std::string cir = "cir --horizon 1 --steps 3 --degree 7 --thin none ";
  // The same tree: the two differ by the ODE's tolerance of 1e-8 and rounding.
  CHECK(value_of(place, cir + "--payoff r --discount r") ==
        Approx(value_of(place, cir + "--payoff r*exp(-integral)")).epsilon(1e-7));
  CHECK(value_of(place, cir + "--payoff r --discount 0.5") ==
        Approx(std::exp(-0.5) * value_of(place, cir + "--payoff r")).epsilon(1e-14));
}

TEST_CASE("weak: sampled trees have a standard error, and the same bytes for any number of threads") {
  const Workplace place;
  for (const std::string order : {"tree", "spatial"}) {
    const std::string command =
        "heston --horizon 1 --steps 6 --payoff max(s-1,0) --thin tbba --nodes 3000 "
        "--launches 8 --seed 5 --order " +
        order;
    auto one = rows_of(place, command + " --threads 1")[0], two = rows_of(place, command + " --threads 2")[0];
    one.erase("seconds");
    two.erase("seconds");
    CHECK(one == two);
    CHECK(one["standard_error"].get<double>() > 0);
  }
  CHECK(rows_of(place, "gbm --horizon 1 --steps 3 --payoff s")[0]["standard_error"] == 0);
}

TEST_CASE("weak: a tolerance chooses the steps, and the error is told part by part") {
  const Workplace place;
  // Black, Scholes (1973): 10.450583572186.
  const auto row = rows_of(place, "gbm --horizon 1 --payoff max(s-100,0) --discount r --tolerance 1e-4")[0];
  CHECK(row["value"].get<double>() == Approx(10.450583572186).epsilon(1e-5));
  double sum = 0;
  for (const char* part : {"error_discretisation", "error_thinning", "error_ode", "error_sampling"})
    sum += row[part].get<double>();
  CHECK(row["error"].get<double>() == Approx(sum));
  // Narrower kinks change the answer less than they cost; without smoothing the lattice of the tree shows.
  CHECK(value_of(place, "gbm --horizon 1 --steps 8 --payoff max(s-100,0)") !=
        value_of(place, "gbm --horizon 1 --steps 8 --payoff max(s-100,0) --kink-width 0"));
}

TEST_CASE("weak: a tolerance with a sampled tree chooses the launches") {
  const Workplace place;
  const std::string command = "heston --horizon 1 --payoff max(s-1.05,0) --thin ";
  // One tree with systematic sampling in tree order has a standard deviation of 0.08 here, tbba of 0.003: the
  // solves for 4e-2 by the one are about those for 4e-3 by the other.
  for (const auto& [thin, tolerance] :
       std::vector<std::pair<std::string, double>>{{"tbba --nodes 300", 4e-3},
                                                   {"tbba --order tree --nodes 3000", 4e-3},
                                                   {"systematic --order tree --nodes 3000", 4e-2}}) {
    const auto row = rows_of(place, command + thin + " --tolerance " + std::to_string(tolerance))[0];
    CHECK(row["error_sampling"].get<double>() > 0);
    CHECK(row["error_sampling"].get<double>() == Approx(2 * row["standard_error"].get<double>()));
    CHECK(row["error_thinning"] == 0);
    CHECK(row["error"].get<double>() <= tolerance);
    // Heston (1993). H0: normal about a value within the estimate of what is not drawn: 4e-8 beyond 5.5 SE.
    CHECK(std::abs(row["value"].get<double>() - 0.125741987887) <
          row["error_discretisation"].get<double>() + 5.5 * row["standard_error"].get<double>());
  }
  // Given launches stay, and nodes are added.
  const Outcome outcome = place.run(
      "weak heston --horizon 1 --payoff max(s-1.05,0) --tolerance 3e-3 --thin tbba --launches 8 --format "
      "json");
  REQUIRE(outcome.code == 0);
  CHECK(nlohmann::json::parse(outcome.out)["options"]["launches"] == 8);
}

TEST_CASE("weak: every thinning agrees with the whole tree") {
  const Workplace place;
  // No other thinning moves nodes by the exact transition.
  const std::string command = "heston --horizon 1 --steps 4 --square-roots off --payoff s*s --payoff v*s ";
  const auto values = [&](const std::string& options) {
    std::vector<double> all;
    for (const auto& row : rows_of(place, command + options)) {
      all.push_back(row["value"]);
      CHECK(row["standard_error"] == 0);
    }
    return all;
  };
  const std::vector<double> whole = values("--thin none");
  for (const std::string thin : {"recombination", "levelwise", "heavy-first"}) {
    INFO(thin);
    for (const std::string more : {"--nodes 200", "--nodes 100 --recombination-degree 4"}) {
      const std::vector<double> thinned = values("--thin " + thin + " " + more);
      for (std::size_t i = 0; i < whole.size(); ++i) CHECK(thinned[i] == Approx(whole[i]).epsilon(1e-5));
    }
  }
}

TEST_CASE(
    "weak: a tolerance that is not reached gives the best value, a warning of what would help, exit code 1") {
  const Workplace place;
  const std::string heston = "weak heston --horizon 1 --payoff max(s-1,0) ";
  for (const auto& [options, part] : std::vector<std::pair<std::string, std::string>>{
           {"--tolerance 1e-7 --nodes 20", "needs more --nodes"},
           {"--tolerance 1e-9 --thin none --degree 7", "--thin recombination"},
           {"--tolerance 1e-4 --thin tbba --nodes 30 --launches 3", "more --nodes or --launches"},
           {"--tolerance 1e-300", "rounding"},
           {"--tolerance 1e-9 --rtol 1e-2 --atol 1e-2 --degree 5", "smaller --rtol"}}) {
    const Outcome outcome = place.run(heston + options + " --quiet --format json");
    INFO(options << "\n" << outcome.err);
    CHECK(outcome.code == 1);
    CHECK(cli::lines_of(outcome.err).size() == 1);
    CHECK_THAT(outcome.err, Catch::StartsWith("warning: tolerance ") && Catch::Contains(part));
    const auto row = nlohmann::json::parse(outcome.out)["rows"][0];
    // Heston (1993), by Fourier integrals.
    CHECK(std::abs(row["value"].get<double>() - 0.14945225829085) < row["error"].get<double>());
  }
}

TEST_CASE("weak: a bound that takes the order is never claimed to be within the tolerance") {
  const Workplace place;
  // The drift is not affine: no exact transition is known.
  place.write(
      "held.toml",
      "name = \"held\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.3, lower = 0.0, upper = 1.0, "
      "boundary = \"clamp\" }\n[drift]\nx = \"0.5*(0.4-x^3)\"\n[diffusion]\nx = [\"sqrt(x*(1-x))\"]\n");
  const Outcome held = place.run("weak held.toml --horizon 1 --payoff x^2 --tolerance 1e-3 --quiet");
  CHECK(held.code == 1);
  CHECK_THAT(held.err, Catch::Contains("leads out of the bound x = 0"));
  // No node comes near the bound: it takes nothing.
  place.write("far.toml",
              "name = \"far\"\nconvention = \"ito\"\n[state]\nf = { initial = 100.0, lower = 0.0, boundary = "
              "\"absorb\" }\n[drift]\nf = \"0\"\n[diffusion]\nf = [\"0.8*f^0.7\"]\n");
  CHECK(place.run("weak far.toml --horizon 1 --payoff max(f-100,0) --tolerance 1e-2 --quiet").code == 0);
}

TEST_CASE("weak: Jacobi's diffusion by its exact transition, whether or not it reaches its bounds") {
  const Workplace place;
  const auto model = [&](const std::string& drift, const std::string& boundary) {
    place.write(
        "jacobi.toml",
        "name = \"jacobi\"\nconvention = \"ito\"\n[state]\nx = { initial = 0.3, lower = 0.0, upper = 1.0, "
        "boundary = \"" +
            boundary + "\" }\n[drift]\nx = \"" + drift + "\"\n[diffusion]\nx = [\"sqrt(x*(1-x))\"]\n");
  };
  // The equations of its moments: E x^2 = 0.2103080610472816, E x^4 = 0.1234218509112919.
  model("0.5*(0.4-x)", "clamp");
  const auto rows = rows_of(place, "jacobi.toml --horizon 1 --payoff x^2 --payoff x^4 --tolerance 1e-6");
  CHECK(rows[0]["value"].get<double>() == Approx(0.2103080610472816).epsilon(1e-12));
  CHECK(rows[1]["value"].get<double>() == Approx(0.1234218509112919).epsilon(1e-12));
  CHECK_THAT(
      place.run("model show jacobi.toml").out,
      Catch::Contains("exact transition: x: Jacobi's, dx = (0.2 + -0.5 x) dt + sqrt(1 (x - 0)(1 - x)) dB"));
  // Wright and Fisher's: 0.21 e^{-1}.
  model("0", "absorb");
  CHECK(value_of(place, "jacobi.toml --horizon 1 --payoff x*(1-x) --steps 4") ==
        Approx(0.21 * std::exp(-1)).epsilon(1e-12));
}

TEST_CASE("weak: Heston's model with a correlation has the price of the factor written by hand") {
  const Workplace place;
  const auto model = [&](const std::string& file, const std::string& v, const std::string& more) {
    place.write(file,
                "name = \"heston\"\nconvention = \"ito\"\n[parameters]\nrho = -0.5\n[state]\n"
                "s = { initial = 100 }\nv = { initial = 0.04, lower = 0 }\n[drift]\ns = \"0.02*s\"\n"
                "v = \"1.5*(0.05 - v)\"\n[diffusion]\ns = [\"sqrt(v)*s\", 0]\nv = " +
                    v + "\n" + more);
  };
  model("correlated.toml", "[0, \"0.4*sqrt(v)\"]", "[noise]\ncorrelation = [[1, \"rho\"], [\"rho\", 1]]\n");
  model("by-hand.toml", "[\"0.4*rho*sqrt(v)\", \"0.4*sqrt((1 - rho^2)*v)\"]", "");
  const std::string question = " --horizon 0.75 --steps 16 --degree 7 --payoff max(s-105,0)";
  const double correlated = value_of(place, "correlated.toml" + question);
  // Heston (1993) by quadrature of his characteristic function, undiscounted.
  CHECK(correlated == Approx(5.2197880099).margin(2e-5));
  CHECK(correlated == Approx(value_of(place, "by-hand.toml" + question)).epsilon(1e-12));
  // Without its transition, by flows.
  const std::string flows = question + " --square-roots off --nodes 300";
  CHECK(value_of(place, "correlated.toml" + flows) ==
        Approx(value_of(place, "by-hand.toml" + flows)).epsilon(1e-9));
  const std::string shown = place.run("model show correlated.toml").out;
  CHECK_THAT(shown, Catch::Contains("correlation of the Brownian motions") && Catch::Contains("  rho, 1\n") &&
                        Catch::Contains("exact transition: s is lognormal given these"));
}

TEST_CASE("weak: inputs, against closed forms") {
  const Workplace place;
  const auto model = [&](const std::string& between, const std::string& drift, const std::string& diffusion) {
    place.write("m.toml", "name = \"m\"\nconvention = \"ito\"\n[inputs]\nu = { between = \"" + between +
                              "\" }\n[state]\ns = { initial = 1.0 }\n[drift]\ns = \"" + drift +
                              "\"\n[diffusion]\ns = [\"" + diffusion + "\"]\n");
  };
  place.write("u.csv", "t,u,other\n0,0.1,x\n0.25,0.5,\n0.6,0.2,y\n1,0.3,z\n");
  const std::vector<double> t{0, 0.25, 0.6, 1}, u{0.1, 0.5, 0.2, 0.3};
  for (const bool linear : {false, true}) {
    const std::string between = linear ? "linear" : "previous";
    INFO(between);
    // s_b = e s_a + (1 - e) u(a) + u' (D - (1 - e)), e = exp(-D), and the integral of u^2.
    double mean = 1, variance = 0;
    for (std::size_t i = 0; i + 1 < t.size(); ++i) {
      const double D = t[i + 1] - t[i], e = std::exp(-D), end = linear ? u[i + 1] : u[i];
      mean = e * mean + (1 - e) * u[i] + (end - u[i]) / D * (D - (1 - e));
      variance += D * (u[i] * u[i] + u[i] * end + end * end) / 3;
    }
    model(between, "u - s", "0.3");
    CHECK(value_of(place, "m.toml --payoff s --horizon 1 --steps 8 --inputs u.csv") ==
          Approx(mean).margin(1e-8));
    CHECK(value_of(place, "m.toml --payoff s+u --horizon 1 --steps 8 --inputs u.csv") ==
          Approx(mean + 0.3).margin(1e-8));
    // Black and Scholes' call with the variance that is integrated.
    const auto normal = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
    const double root = std::sqrt(variance), d1 = (std::log(1 / 1.05) + 0.02) / root + root / 2;
    const double call = std::exp(0.02) * normal(d1) - 1.05 * normal(d1 - root);
    model(between, "0.02*s", "u*s");
    const auto row =
        rows_of(place, "m.toml --payoff max(s-1.05,0) --horizon 1 --tolerance 1e-5 --inputs u.csv")[0];
    const double error = std::abs(row["value"].get<double>() - call);
    CHECK(error < 1e-6);
    CHECK(error <= row["error"].get<double>());
    // Jumps beside other times to report at.
    const auto rows =
        rows_of(place, "m.toml --payoff s --horizon 0.5,0.6,0.9 --tolerance 1e-5 --inputs u.csv");
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(rows[k]["value"].get<double>() ==
            Approx(std::exp(0.02 * rows[k]["horizon"].get<double>())).margin(1e-5));
  }
  CHECK_THAT(place.run("model show m.toml").out, Catch::Contains("u: linear between its times"));
}

TEST_CASE("inputs that are missing or wrong are told by place and value, with exit code 2") {
  const Workplace place;
  const std::string text =
      "name = \"m\"\nconvention = \"ito\"\n[inputs]\nu = { between = \"previous\" }\n[state]\nx = { initial "
      "= 1.0 }\n"
      "[drift]\nx = \"u - x\"\n[diffusion]\nx = [\"0.3\"]\n[observation]\nkind = \"discrete\"\nh = [\"x\"]\n"
      "noise = { law = \"gaussian\", sd = 0.5 }\n";
  place.write("m.toml", text);
  place.write("u.csv", "t,u\n0,1\n0.5,2\n1,3\n");
  place.write("y.csv", "t,y1\n0,1\n0.6,1.2\n1,1.4\n");
  place.write("both.csv", "u,t,y1\n1,0,1\n2,0.6,1.2\n3,1,1.4\n");
  place.write("long.csv", "t,y1\n0,1\n2,1.2\n");
  place.write("nan.csv", "t,u\n0,1\n0.5,nan\n1,3\n");
  place.write("unsorted.csv", "t,u\n0,1\n0.5,2\n0.4,3\n");
  place.write("gap.csv", "t,u\n0,1\n0.5,\n1,3\n");
  place.write(
      "study.toml",
      "title = \"s\"\nquantity = \"mean_x\"\nmeasure = [\"absolute\"]\nreference = \"none\"\n[observations]\n"
      "horizon = 1.0\nsteps = 10\nkeep = 10\n[options]\nmodel = \"./m.toml\"\nnodes = [10]\n");
  const std::vector<std::pair<std::string, std::string>> refused{
      {"filter m.toml --observations y.csv", "y.csv: the model depends on inputs: give a CSV file t,u"},
      {"filter m.toml --observations - --inputs u.csv", "standard input: a stream is filtered row by row"},
      {"filter m.toml --observations long.csv --inputs u.csv",
       "u.csv: column u: the input u is given from t = 0 to t = 1"},
      {"filter m.toml --observations y.csv --inputs nan.csv",
       "nan.csv:3: column u: not a finite number (nan)"},
      {"filter m.toml --observations y.csv --inputs unsorted.csv",
       "unsorted.csv:4: column t: times must increase"},
      {"filter m.toml --observations y.csv --inputs gap.csv", "gap.csv:3: column u: a value is missing"},
      {"filter m.toml --observations y.csv --inputs y.csv", "y.csv:1: expected the header t,u"},
      {"filter nile --observations y.csv --inputs u.csv", "--inputs: the model has no [inputs] (u.csv)"},
      {"compare nile nile:sd_level=30 --observations y.csv --inputs u.csv", ""},
      {"weak m.toml --payoff x --horizon 1 --steps 2", "--inputs: the model depends on inputs"},
      {"weak m.toml --payoff x --horizon 2 --steps 2 --inputs u.csv", "and the steps end at t = 2"},
      {"weak m.toml --payoff x --horizon 1 --steps 2 --inputs u.csv --grid kusuoka", "no room for the jumps"},
      {"simulate m.toml --horizon 1 --steps 10 --observations out.csv",
       "--inputs: the model depends on inputs"},
      {"tree m.toml --horizon 1 --steps 3 --dot -", "model m: depends on the input u"},
      {"study study.toml --output out", "depends on the input u, and a study has no file for inputs"}};
  for (const auto& [command, message] : refused) {
    INFO(command);
    const Outcome outcome = place.run(command);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::Contains(message));
  }
  // As columns of the observations, in any order, and from a file of their own.
  place.write("same.csv", "t,u\n0,1\n0.6,2\n1,3\n");
  const std::string columns = place.run("filter m.toml --observations both.csv --quiet").out;
  CHECK(columns == place.run("filter m.toml --observations y.csv --inputs same.csv --quiet").out);
  CHECK(columns == place.run("filter m.toml --observations both.csv --inputs same.csv --quiet").out);
  CHECK_THAT(place.run("compare m.toml nile --observations y.csv --inputs same.csv --quiet").out,
             Catch::Contains("log_evidence_2"));
  // What was used is told, and a run is taken up with the same inputs only.
  const std::string filter = "filter m.toml --observations y.csv --format json --quiet --inputs ";
  CHECK(nlohmann::json::parse(place.run(filter + "same.csv").out)["options"]["inputs"] == "same.csv");
  CHECK(place.run(filter + "same.csv --checkpoint c").code == 0);
  CHECK(place.run(filter + "same.csv --resume c").code == 0);
  const Outcome other = place.run(filter + "u.csv --resume c");
  CHECK(other.code == 2);
  CHECK_THAT(other.err, Catch::Contains("inputs"));
}

TEST_CASE("weak: several horizons and payoffs from one tree") {
  const Workplace place;
  const auto rows = rows_of(place,
                            "gbm --horizon 0.25,0.5,1 --degree 7 --steps 32 --discount r --payoff s --payoff "
                            "max(s-100,0) --richardson");
  REQUIRE(rows.size() == 6);
  // Black, Scholes (1973), r 0.05, sigma 0.2, S = K = 100.
  const double call[] = {4.614997129603, 6.888728577681, 10.450583572186};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(rows[2 * i]["horizon"] == std::array{0.25, 0.5, 1.0}[i]);
    CHECK(rows[2 * i]["extrapolated"].get<double>() == Approx(100).epsilon(1e-8));
    CHECK(rows[2 * i + 1]["extrapolated"].get<double>() == Approx(call[i]).epsilon(1e-5));
  }
  const auto chosen = rows_of(
      place,
      "gbm --horizon 0.25,1 --discount r --payoff max(s-100,0) --payoff max(s-140,0) --tolerance 1e-3");
  REQUIRE(chosen.size() == 4);
  CHECK(std::abs(chosen[0]["value"].get<double>() - call[0]) < chosen[0]["error"].get<double>());
  CHECK(std::abs(chosen[2]["value"].get<double>() - call[2]) < chosen[2]["error"].get<double>());
  // Heston (1993), by Lewis' integral: the exact transition at every time.
  const auto strip = rows_of(place, "heston --horizon 0.25,0.5,1 --payoff max(s-1,0) --tolerance 1e-6");
  const double heston[] = {0.06661057729125, 0.09868949267712, 0.14945225829085};
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(std::abs(strip[i]["value"].get<double>() - heston[i]) < strip[i]["error"].get<double>());
  CHECK(strip[2]["error"].get<double>() < 1e-6);
  CHECK(place.run("weak gbm --horizon 1,0.5 --steps 4 --payoff s").code == 2);
  CHECK(place.run("weak gbm --horizon 0.5,1 --steps 4 --average s --payoff average_s").code == 2);
}

TEST_CASE("weak: a strip costs at most one and a half times its dearest option") {
  // 20 strikes and 4 maturities; work in ODE solves. Tolerances are 1e-3 and 1e-4 of the price of the option at the
  // money in one year. The dearest of some of the options costs no more than the dearest of all.
  const Workplace place;
  struct Problem {
    std::string model;
    double spot;
    std::array<std::string, 2> tolerances;
  };
  for (const Problem& problem :
       {Problem{"gbm", 100, {"0.01", "0.001"}}, Problem{"heston", 1, {"1e-4", "1e-5"}}}) {
    const auto call = [&](int i) {
      return fmt::format(" --payoff max(s-{},0)", problem.spot * (0.7 + 0.6 * i / 19));
    };
    std::string strikes;
    for (int i = 0; i < 20; ++i) strikes += call(i);
    for (const std::string& tolerance : problem.tolerances) {
      const auto solves = [&](const std::string& horizon, const std::string& payoffs) {
        const auto rows =
            rows_of(place, problem.model + " --horizon " + horizon + " --tolerance " + tolerance + payoffs);
        for (const auto& row : rows) CHECK(row["error"].get<double>() <= std::stod(tolerance));
        return rows.front()["ode_solves"].get<double>();
      };
      double dearest = 0;
      for (const char* horizon : {"0.25", "0.5", "1", "2"})
        for (int i = 0; i < 20; i += 3) dearest = std::max(dearest, solves(horizon, call(i)));
      INFO(problem.model << " " << tolerance);
      CHECK(solves("0.25,0.5,1,2", strikes) <= 1.5 * dearest);
    }
  }
}

TEST_CASE("weak: the options that a tolerance chose reproduce its value for several times") {
  const Workplace place;
  const std::string strip = "gbm --horizon 0.25,0.5,2 --payoff max(s-100,0) ";
  const Outcome outcome = place.run("weak " + strip + "--tolerance 1e-2 --quiet --format json");
  REQUIRE(outcome.code == 0);
  const auto json = nlohmann::json::parse(outcome.out);
  const auto& o = json["options"];
  const auto again = rows_of(
      place,
      strip + fmt::format("--degree {} --steps {} --patch-width {} --rtol {} --atol {} --richardson",
                          o["degree"].get<int>(), o["steps"].get<int>(), o["patch-width"].get<double>(),
                          o["rtol"].get<double>(), o["atol"].get<double>()));
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(again[i]["extrapolated"].get<double>() ==
          Approx(json["rows"][i]["value"].get<double>()).epsilon(1e-13));
}

TEST_CASE("weak: the options that a tolerance chose reproduce its value") {
  const Workplace place;
  const std::string call = "gbm --horizon 1 --discount r --payoff max(s-100,0) ";
  const Outcome outcome = place.run("weak " + call + "--tolerance 1e-4 --quiet --format json");
  REQUIRE(outcome.code == 0);
  const auto json = nlohmann::json::parse(outcome.out);
  const auto& o = json["options"];
  CHECK(o["kinks"] == "last-step");
  std::string options;
  for (const char* name : {"steps", "degree", "patch-width", "rtol", "atol"})
    options += std::string("--") + name + " " + o[name].dump() + " ";
  const auto again = rows_of(place, call + options + "--kinks last-step --richardson")[0];
  CHECK(again["extrapolated"] == json["rows"][0]["value"]);
}

TEST_CASE("weak: comparisons, if, sign and their compositions by the law of the last step") {
  const Workplace place;
  const std::string gbm = "gbm --horizon 1 --steps 32 --degree 7 --richardson ";
  const auto value = [&](const std::string& model, const std::string& payoff) {
    return rows_of(place, model + "--payoff " + payoff)[0]["extrapolated"].get<double>();
  };
  // P(S > 100) = Phi(0.15); E (S - 100)^+ = 10.450583572186 e^{0.05}.
  const double digital = 0.559617692370243, call = 10.986396449701;
  CHECK(value(gbm, "s>100") == Approx(digital).epsilon(1e-8));
  CHECK(value(gbm, "if(s>100,1,0)") == Approx(digital).epsilon(1e-8));
  CHECK(value(gbm, "(1+sign(s-100))/2") == Approx(digital).epsilon(1e-8));
  CHECK(value(gbm, "if(s>100,s-100,0)") == Approx(call).epsilon(1e-7));
  CHECK(value(gbm, "max(s-100,0)-max(s-100,0)*(s<=100)") == Approx(call).epsilon(1e-7));
  // Kinks inside kinks, and two strikes in one maximum; quadrature of the lognormal density.
  CHECK(value(gbm, "abs(abs(s-100)-5)") == Approx(12.826834653).epsilon(1e-6));
  CHECK(value(gbm, "max(max(s-100,110-s),0)") == Approx(21.738121881).epsilon(1e-6));
  CHECK(value(gbm, "sqrt(max(s-100,0))*s") == Approx(286.447483367).epsilon(1e-6));
  // Two kinks of one argument: a call spread and the band between the strikes.
  CHECK(value(gbm, "(s>90)*(s<110)") == Approx(value(gbm, "s>90") - value(gbm, "s>110")).epsilon(1e-7));
}

TEST_CASE("weak: formulas of Lie polynomials") {
  const Workplace place;
  REQUIRE(place.run("formulas construct --degree 5 --dimension 2 --lie --output lie.json").code == 0);
  CHECK_THAT(place.run("formulas verify lie.json").out, Catch::Contains("holds to degree 5"));
  CHECK_THAT(place.run("formulas show lie.json").out, Catch::Contains("[1,2]"));
  // Both are of degree 5; at n = 6 either is within 2e-4 of 0.125741987887 + ... of this smooth payoff.
  const std::string heston = "heston --horizon 1 --steps 6 --payoff s*s ";
  CHECK(value_of(place, heston + "--formula ./lie.json") ==
        Approx(value_of(place, heston + "--degree 5")).epsilon(1e-4));
}

TEST_CASE("weak: what is wrong is one line and exit code 2") {
  const Workplace place;
  const std::string gbm = "weak gbm --horizon 1 --steps 4 ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {gbm, "--payoff"},
      {gbm + "--payoff q", "--payoff:1:1: unknown"},
      {gbm + "--payoff s+", "--payoff"},
      {gbm + "--payoff s --average q", "--average:1:1"},
      {gbm + "--payoff s --average s --average s", "already that of a state"},
      {gbm + "--payoff s --average r=s", "already that of a state, a parameter"},
      {gbm + "--payoff s --integral s", "NAME=EXPR"},
      {gbm + "--payoff s --discount q", "--discount:1:1"},
      {"weak gbm --horizon 1 --payoff s", "--steps"},
      {"weak gbm --horizon 0 --steps 2 --payoff s", "--horizon"},
      {gbm + "--payoff s --gamma 3", "--grid kusuoka"},
      {gbm + "--payoff s --launches 3", "draws nothing"},
      {gbm + "--payoff s --thin none --nodes 10", "--nodes"},
      {gbm + "--payoff s --thin tbba --recombination-degree 3", "--recombination-degree"},
      {gbm + "--payoff s --degree 4", "no such formula"},
      {gbm + "--payoff s --formula ninomiya-victoir-5-2", "2 Brownian motions, the model has 1"},
      {gbm + "--payoff s --degree 5 --formula lyons-victoir-5-1", "not both"},
      {"weak gbm --horizon 1 --steps 1 --payoff s --richardson", "at least 2"},
      {"weak heston --horizon 1 --steps 12 --payoff s --thin none", "9^12 = 2.82e+11 leaves"},
      {"weak heston --horizon 1 --steps 12 --payoff s --thin none", "--thin recombination"},
      {gbm + "--payoff s --nodes 900000000", "--nodes"},
      {gbm + "--payoff s --tolerance 1e-3", "--steps"},
      {gbm + "--payoff s --thin levelwise --launches 3", "draws nothing"},
      {gbm + "--payoff s --thin heavy-first --order tree", "--order"},
      {"weak gbm --horizon 1 --payoff s --tolerance 1e-3 --launches 4", "draws nothing"},
      {"weak gbm --horizon 1 --payoff s --tolerance 1e-3 --thin tbba --launches 1", "2 or more"},
      {gbm + "--payoff s --kink-width -1", "must not be negative"},
      {"weak gmb --horizon 1 --steps 4 --payoff s", "gbm"},
  };
  for (const auto& [command, part] : cases) {
    const Outcome outcome = place.run(command);
    INFO(command << "\n" << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(cli::lines_of(outcome.err).size() == 1);
    CHECK_THAT(outcome.err, Catch::StartsWith("wienertree: ") && Catch::Contains(part));
    CHECK(outcome.out.empty());
  }
  const Outcome failed = place.run("weak gbm --horizon 1 --steps 2 --payoff log(s-100)");
  CHECK(failed.code == 1);
  CHECK_THAT(failed.err, Catch::Contains("not finite"));
}
