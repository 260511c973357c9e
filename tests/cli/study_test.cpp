// The study: its tables, what it refuses, and that one killed at any moment goes on to the same table.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <regex>

#include "program.hpp"

using namespace cli;

namespace {

const std::string small_study = R"(
title = "small"
command = "filter"
measure = ["rmse", "absolute"]
quantity = ["mean_x", "wasserstein_x"]
reference = "exact"
launches = 3
[observations]
horizon = 4
steps = 4000
keep = 400
paths = 3
[options]
model = "benes"
steps = [10, 20, 40]
[[series]]
label = "klv"
nodes = 30
[[series]]
label = "tbba"
thin = "tbba"
nodes = [50, 200]
[[plot]]
title = "a"
x = "steps"
[[plot]]
x = "seconds"
along = "steps"
quantity = "wasserstein_x"
[[claim]]
text = "first, with a comma"
slope = "klv"
within = [-4, -1]
[[claim]]
text = "second"
ratio = "klv"
to = "tbba, nodes 50"
within = [0, 1e-9]
holds = false
)";

// Without what the machine decides: the last column, processor seconds.
std::string without_seconds(const std::string& csv) {
  std::string kept;
  for (const std::string& line : lines_of(csv)) kept += line.substr(0, line.rfind(',')) + '\n';
  return kept;
}

std::string slopes_of_first_plot(const std::string& csv) {
  std::string kept;
  for (const std::string& line : lines_of(csv))
    if (!line.starts_with("2,")) kept += line + '\n';
  return kept;
}

}  // namespace

TEST_CASE("a study leaves runs, table, slopes, claims, pictures and a page that needs no other file") {
  Workplace w;
  w.write("small.toml", small_study);
  const Outcome outcome = w.run("study small.toml --output out --threads 2");
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  // klv draws nothing: 3 cells x 3 paths; tbba 6 x 3 x 3.
  CHECK(lines_of(w.read("out/runs.csv")).size() == 1 + 9 + 54);
  CHECK(lines_of(w.read("out/table.csv")).size() == 1 + 9);
  CHECK(lines_of(w.read("out/slopes.csv")).size() == 1 + 6);
  CHECK(w.read("out/claims.csv").find("\"first, with a comma\"") != std::string::npos);
  CHECK(w.read("out/claims.csv").find("false,true") != std::string::npos);
  for (const char* name : {"out/plot-1.svg", "out/plot-1.png", "out/plot-2.svg", "out/plot-2.png"})
    CHECK(!w.read(name).empty());
  const std::string page = w.read("out/index.html");
  CHECK(page.find("<svg") != std::string::npos);
  CHECK(page.find("data:text/plain;charset=utf-8;base64,") != std::string::npos);
  // Nothing is fetched: no address but the names of XML's namespaces.
  const std::regex fetched("(src|href)=\"(https?:)?//");
  CHECK(!std::regex_search(page, fetched));
}

namespace {

// Whatever does not depend on the machine is the same in both directories.
void check_same(const Workplace& w, const std::string& a, const std::string& b) {
  for (const char* table : {"/runs.csv", "/table.csv"})
    CHECK(without_seconds(w.read(a + table)) == without_seconds(w.read(b + table)));
  CHECK(slopes_of_first_plot(w.read(a + "/slopes.csv")) == slopes_of_first_plot(w.read(b + "/slopes.csv")));
  CHECK(w.read(a + "/claims.csv") == w.read(b + "/claims.csv"));
}

}  // namespace

TEST_CASE("a study killed at random moments and taken up again gives the table of one left alone") {
  Workplace w;
  w.write("small.toml", small_study);
  const auto began = std::chrono::steady_clock::now();
  REQUIRE(w.run("study small.toml --output alone --threads 1 --quiet").code == 0);
  const auto took =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - began);
  std::mt19937 engine(std::random_device{}());
  int killed = 0;
  for (int round = 0; round < 10; ++round) {
    w.kill_after = std::chrono::microseconds(std::uniform_int_distribution<long>(1000, took.count())(engine));
    const Outcome outcome = w.run("study small.toml --output again --threads 2 --quiet");
    killed += outcome.signal != 0;
    CHECK((outcome.signal != 0 || outcome.code == 0));
  }
  w.kill_after.reset();
  const Outcome last = w.run("study small.toml --output again --threads 2 --quiet");
  INFO(last.err);
  REQUIRE(last.code == 0);
  CHECK(killed > 0);
  check_same(w, "alone", "again");
}

TEST_CASE("a journal that ends anywhere, in the middle of a line too, is taken up") {
  Workplace w;
  w.write("small.toml", small_study);
  REQUIRE(w.run("study small.toml --output alone --quiet").code == 0);
  const std::string runs = w.read("alone/runs.csv");
  for (const double part : {0.0, 0.001, 0.02, 0.3, 0.77, 0.999}) {
    const std::string directory = "cut" + std::to_string(part);
    std::filesystem::create_directory(w.directory() / directory);
    w.write(directory + "/wienertree-study.json", w.read("alone/wienertree-study.json"));
    w.write(directory + "/runs.csv",
            runs.substr(0, static_cast<std::size_t>(part * static_cast<double>(runs.size()))));
    const Outcome outcome = w.run("study small.toml --quiet --output " + directory);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    check_same(w, "alone", directory);
  }
}

TEST_CASE("a finished study computes nothing anew, and a longer sweep only what is missing") {
  Workplace w;
  w.write("small.toml", small_study);
  REQUIRE(w.run("study small.toml --output out --quiet").code == 0);
  const std::string before = w.read("out/runs.csv");
  REQUIRE(w.run("study small.toml --output out --quiet").code == 0);
  CHECK(w.read("out/runs.csv") == before);  // processor times included
  w.write("small.toml", std::regex_replace(small_study, std::regex("steps = \\[10, 20, 40\\]"),
                                           "steps = [10, 20, 40, 80]"));
  const Outcome outcome = w.run("study small.toml --output out");
  CHECK(outcome.err.find("84 runs, 21 of them computed now") != std::string::npos);
}

TEST_CASE("what a study cannot be is refused with place and value") {
  Workplace w;
  int number = 0;
  const auto complaint = [&](const std::string& from, const std::string& to) {
    w.write("small.toml", std::regex_replace(small_study, std::regex(from), to));
    const Outcome outcome = w.run("study small.toml --quiet --output out" + std::to_string(++number));
    CHECK(outcome.code == 2);
    CHECK(lines_of(outcome.err).size() == 1);
    return outcome.err;
  };
  CHECK(complaint("nodes = 30", "nods = 30").find("small.toml:16:1, series[1]") != std::string::npos);
  CHECK(complaint("nodes = 30", "nods = 30").find("--nodes") != std::string::npos);
  CHECK(complaint("nodes = 30", "nodes = 0").find("must be at least 1 (0)") != std::string::npos);
  CHECK(complaint("nodes = 30", "launches = 0").find("launches") != std::string::npos);
  CHECK(complaint("nodes = 30", "threads = 2").find("threads") != std::string::npos);
  CHECK(complaint("rmse", "rsme").find("did you mean 'rmse'?") != std::string::npos);
  CHECK(complaint("wasserstein_x", "wasserstein_z").find("wasserstein_z") != std::string::npos);
  CHECK(complaint("slope = \"klv\"", "slope = \"kvl\"").find("there are: klv") != std::string::npos);
  CHECK(complaint("label = \"tbba\"", "label = \"klv\"").find("two series have this label") !=
        std::string::npos);
  CHECK(complaint("keep = 400", "keep = 300").find("must divide") != std::string::npos);
  CHECK(complaint("title = \"small\"", "title = ").find("TOML syntax") != std::string::npos);
  CHECK(w.run("study small.toml --full --output out").code == 2);
  CHECK(w.run("study stepz --output out").err.find("did you mean 'steps'?") != std::string::npos);
}

TEST_CASE("runs of another record are not taken for those of this one, and are kept") {
  Workplace w;
  w.write("small.toml", small_study);
  REQUIRE(w.run("study small.toml --output out --quiet").code == 0);
  const std::string before = w.read("out/runs.csv");
  w.write("small.toml", std::regex_replace(small_study, std::regex("horizon = 4"), "horizon = 5"));
  Outcome outcome = w.run("study small.toml --output out");
  CHECK(outcome.err.find("63 runs, 63 of them computed now") != std::string::npos);
  w.write("small.toml", small_study);
  outcome = w.run("study small.toml --output out");
  CHECK(outcome.err.find("63 runs, 0 of them computed now") != std::string::npos);
  CHECK(w.read("out/runs.csv").starts_with(before));
}

TEST_CASE("a weak study takes payoffs together against closed forms") {
  Workplace w;
  w.write("weak.toml", R"toml(
title = "weak"
command = "weak"
pool = ["payoff"]
[reference.by_payoff]
s = "100*exp(r)"
"s^2" = "100^2*exp(2*r + sigma^2)"
[options]
model = "gbm"
horizon = 1
payoff = ["s", "s^2"]
steps = [1, 2, 4]
degree = [3, 5]
[[plot]]
x = "steps"
)toml");
  const Outcome outcome = w.run("study weak.toml --output out");
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(lines_of(w.read("out/runs.csv")).size() == 1 + 12);
  CHECK(lines_of(w.read("out/table.csv")).size() == 1 + 6);
  CHECK(lines_of(w.read("out/slopes.csv")).size() == 1 + 2);
}
