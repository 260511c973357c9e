/// Every bundled study, or those of WIENERTREE_STUDIES, in its default size: each of its claims, with the
/// tolerance that stands beside it in data/studies, comes out as the study says. Source of truth: the
/// reference of each study, an exact filter or a closed form. Seeds are fixed, and results do not depend on
/// the number of threads, so that a claim which held will hold. Criterion: the last column of claims.csv is
/// true throughout, and a study takes at most 240 s of processor time: two minutes on two cores.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>

#include "cli/program.hpp"

using namespace cli;

namespace {

std::vector<std::string> studies() {
  std::vector<std::string> names = WIENERTREE_STUDIES;
  if (!names.empty()) return names;
  for (const auto& entry : std::filesystem::directory_iterator(WIENERTREE_SOURCE_DIR "/data/studies"))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  REQUIRE(names.size() >= 10);
  return names;
}

double processor_seconds(const std::string& runs) {
  double sum = 0;
  const std::vector<std::string> lines = lines_of(runs);
  for (std::size_t r = 1; r < lines.size(); ++r) sum += std::stod(lines[r].substr(lines[r].rfind(',') + 1));
  return sum;
}

}  // namespace

TEST_CASE("the claims of bundled studies come out as they say, in time") {
  for (const std::string& name : studies()) {
    Workplace w;
    const Outcome outcome = w.run("study " + name + " --output out");
    fmt::print("{}", outcome.err);
    INFO(name << ": " << outcome.err);
    REQUIRE(outcome.code == 0);
    const double seconds = processor_seconds(w.read("out/runs.csv"));
    fmt::print("  {:.1f} s of processor time in its runs\n\n", seconds);
    CHECK(seconds < 240);
    const std::vector<std::string> claims = lines_of(w.read("out/claims.csv"));
    CHECK(claims.size() > 1);
    for (std::size_t r = 1; r < claims.size(); ++r) {
      INFO(claims[r]);
      CHECK(claims[r].ends_with(",true"));
    }
  }
}
