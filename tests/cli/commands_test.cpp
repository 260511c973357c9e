/// formulas, model, tree, pictures, help: each does what its help says.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>

#include "program.hpp"

using cli::Outcome;
using cli::Workplace;

namespace {

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("formulas are listed, shown, verified and constructed") {
  const Workplace place;
  const std::string list = output_of(place, "formulas list");
  for (const char* name : {"lyons-victoir-5-1", "ninomiya-victoir-5-4", "moment-equations-11-1"})
    CHECK_THAT(list, Catch::Contains(name));
  CHECK(cli::lines_of(list).size() >= 15);
  const std::string shown = output_of(place, "formulas show lyons-victoir-5-1");
  CHECK_THAT(shown, Catch::Contains("degree 5") && Catch::Contains("holds to degree 5") &&
                        Catch::Contains("0.16666666666666666"));
  CHECK(occurrences(shown, "\npath ") == 3);
  CHECK_THAT(output_of(place, "formulas verify moment-equations-7-2"), Catch::Contains("holds to degree 7"));
  output_of(place, "formulas construct --degree 3 --dimension 4 --output f.json");
  const auto json = nlohmann::json::parse(place.read("f.json"));
  CHECK(json["paths"].size() == 8);
  CHECK(json["dimension"] == 4);
  CHECK(output_of(place, "formulas construct --degree 3 --dimension 4") == place.read("f.json"));
  CHECK_THAT(output_of(place, "formulas verify f.json"), Catch::Contains("holds to degree 3"));
}

TEST_CASE("models are listed and shown with what follows from their coefficients") {
  const Workplace place;
  const std::string list = output_of(place, "model list");
  for (const char* name : {"benes", "heston", "linear-3d", "lorenz63", "nile", "stochastic-volatility"})
    CHECK_THAT(list, Catch::Contains(name));
  const std::string benes = output_of(place, "model show benes --set mu=0.5");
  for (const char* part : {"mu = 0.5", "Ito drift (as given)", "V_0", "V_1", "Jacobian of V_0", "tanh",
                           "bracket [V_0, V_1]", "h_1", "exact filter: benes"})
    CHECK_THAT(benes, Catch::Contains(part));
  const std::string heston = output_of(place, "model show heston");
  for (const char* part : {"2 Brownian motions", "bracket [V_1, V_2]", "observation: none"})
    CHECK_THAT(heston, Catch::Contains(part));
}

TEST_CASE("a model of one's own is used by its path") {
  const Workplace place;
  place.write("mine.toml",
              "name = \"mine\"\nconvention = \"ito\"\n[state]\nx = { initial = 1.0 }\n[drift]\nx = "
              "\"-x\"\n[diffusion]\nx = [\"0.5\"]\n"
              "[observation]\nkind = \"continuous\"\nh = [\"x\"]\n");
  output_of(place, "simulate mine.toml --horizon 1 --steps 300 --observations Y.csv");
  CHECK_THAT(output_of(place, "filter mine.toml --observations Y.csv"), Catch::StartsWith("t,mean_x,"));
  CHECK_THAT(output_of(place, "filter ./mine.toml --observations Y.csv"), Catch::StartsWith("t,mean_x,"));
}

TEST_CASE("the tree is written as GraphViz and GraphML") {
  const Workplace place;
  const Outcome told =
      place.run("tree benes --horizon 2 --steps 4 --nodes 5 --dot t.dot --graphml t.graphml");
  REQUIRE(told.code == 0);
  CHECK_THAT(told.err,
             Catch::Contains("5 generations") && Catch::Contains("ancestors of the last generation: 1 "));
  const std::string dot = place.read("t.dot"), graphml = place.read("t.graphml");
  CHECK_THAT(dot, Catch::Contains("digraph") && Catch::Contains("weight=") && Catch::Contains("count="));
  CHECK_THAT(graphml, Catch::Contains("<graphml") && Catch::Contains("</graphml>"));
  const std::size_t nodes = occurrences(graphml, "<node "), edges = occurrences(graphml, "<edge ");
  CHECK(nodes == edges + 1);
  CHECK(occurrences(dot, "->") == edges);
  CHECK(nodes <= 1 + 4 * 5);
  // The whole tree of 3 paths and 3 steps.
  const std::string whole =
      output_of(place, "tree benes --horizon 2 --steps 3 --thin none --quiet --graphml -");
  CHECK(occurrences(whole, "<node ") == 1 + 3 + 9 + 27);
  cli::simulate_benes(place);
  CHECK_THAT(output_of(place, "tree benes --observations Y.csv --steps 6 --dot -"),
             Catch::Contains("digraph"));
}

TEST_CASE("likelihoods of the steps and weights of the formula make the weights of the whole tree") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string dot = output_of(place,
                                    "tree benes --observations Y.csv --steps 4 --thin none --formula "
                                    "lyons-victoir-5-1 --quiet --dot -");
  const std::vector<double> lambda = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  struct Node {
    double time = 0, weight = 1, log_likelihood = 0;
  };
  std::vector<Node> nodes;
  std::vector<double> path_weight;
  const std::regex node(R"(\d+\[.*time=([^,]*),.*weight=([^,\]]*)(?:, log_likelihood=([^\]]*))?\];)");
  const std::regex edge(R"((\d+)->(\d+) \[branch=(\d+)\];)");
  std::map<double, double> mass;
  for (std::string line : cli::lines_of(dot)) {
    std::erase(line, '"');
    std::smatch part;
    if (std::regex_match(line, part, node)) {
      nodes.push_back({std::stod(part[1]), std::stod(part[2]), part[3].matched ? std::stod(part[3]) : 0});
      path_weight.push_back(nodes.size() == 1 ? 1 : 0);
    } else if (std::regex_match(line, part, edge)) {
      const std::size_t from = std::stoul(part[1]), to = std::stoul(part[2]);
      path_weight[to] = path_weight[from] * lambda[std::stoul(part[3])] * std::exp(nodes[to].log_likelihood);
      mass[nodes[to].time] += path_weight[to];
    }
  }
  REQUIRE(nodes.size() == 1 + 3 + 9 + 27 + 81);
  for (std::size_t n = 1; n < nodes.size(); ++n)
    REQUIRE(nodes[n].weight == Approx(path_weight[n] / mass[nodes[n].time]).epsilon(1e-10));
}

TEST_CASE("the tree is drawn from the start of the record on") {
  const Workplace place;
  cli::simulate_benes(place);
  place.write("late.csv", "t,y1\n100,0\n100.5,0.3\n101,0.2\n101.5,0.4\n");
  output_of(place, "tree benes --observations late.csv --plot t.svg --dot t.dot --quiet");
  CHECK_THAT(place.read("t.dot"),
             Catch::Contains("0[label=\"0 (1)\", time=100,") || Catch::Contains("0[label=0, time=100,"));
  for (const char* part : {"</svg>", "KLV filter", "likelihood", "late.csv"})
    CHECK_THAT(place.read("t.svg"), Catch::Contains(part));
  output_of(place, "tree linear-3d --horizon 1 --steps 3 --plot bare.png");
  CHECK(place.read("bare.png").substr(1, 3) == "PNG");
  const Outcome nothing = place.run("tree benes --horizon 1 --steps 3");
  CHECK(nothing.code == 2);
  CHECK_THAT(nothing.err, Catch::Contains("--plot"));
}

TEST_CASE("pictures are drawn as SVG and PNG") {
  const Workplace place;
  cli::simulate_benes(place);
  const std::string filter =
      "filter benes --method klv --observations Y.csv --steps 40 --output o.csv --signal X.csv --plot ";
  output_of(place, filter + "p.svg");
  output_of(place, filter + "p.png");
  output_of(place, filter + "d.svg --density-at 2");
  const std::string posterior = place.read("p.svg"), law = place.read("d.svg");
  CHECK_THAT(posterior, Catch::Contains("</svg>"));
  for (const char* part : {"benes: KLV filter", "posterior mean", "exact (dashed)", "true signal", "95 %"})
    CHECK_THAT(posterior, Catch::Contains(part));
  for (const char* part : {"t = 2", "exact posterior", "prior (dashed)", "true signal", "density"})
    CHECK_THAT(law, Catch::Contains(part));
  CHECK(place.read("p.png").substr(1, 3) == "PNG");
  CHECK(posterior == [&] {
    output_of(place, filter + "p.svg");
    return place.read("p.svg");
  }());
}

TEST_CASE("every subcommand has help with an example, and --help works everywhere") {
  const Workplace place;
  CHECK_THAT(output_of(place, "--version"), Catch::StartsWith("wienertree "));
  for (const char* command :
       {"", "simulate", "filter", "formulas", "formulas list", "formulas show", "formulas verify",
        "formulas construct", "model", "model list", "model show", "tree", "weak"}) {
    const std::string help = output_of(place, std::string(command) + " --help");
    INFO(command);
    CHECK_THAT(help, Catch::Contains("xample") && Catch::Contains("  wienertree "));
  }
}
