/// Runs of `filter`, `compare` and `weak` that are ended at random moments by SIGKILL, SIGTERM or SIGINT and
/// resumed from their checkpoints, with one thread or two, must end with the bytes of the run that was left
/// alone.
///
/// interrupted_runs [RUNS], 25 by default: one of each kind; each is interrupted three times. `ctest -L slow`
/// makes 1000.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <random>
#include <thread>

#include "program.hpp"

using namespace cli;

namespace {

struct Kind {
  std::string arguments;
  std::string csv, json;  ///< of the run that was left alone
  double seconds = 0;     ///< which that took
  std::size_t runs = 0, stopped = 0, resumed = 0, failed = 0;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all;
  const std::string continuous = "filter benes --observations Y.csv --steps 400 ",
                    discrete = "filter noisy.toml --observations Z.csv ";
  for (const char* options :
       {"--nodes 60", "--thin tbba --nodes 300", "--thin multinomial --nodes 300 --ess-threshold 0.5",
        "--thin residual --nodes 300", "--thin stratified --nodes 300 --prune-weights cubature",
        "--thin systematic --nodes 300 --order tree", "--thin levelwise --nodes 40",
        "--thin heavy-first --nodes 60", "--thin tbba --nodes 50 --launches 3", "--nodes 20 --flow cvode",
        "--method euler --nodes 3000", "--method gaussian-mixture --nodes 1000", "--method benes",
        "--method grid --nodes 200"})
    all.push_back({continuous + options, {}, {}});
  for (const char* options : {"", "--method euler --nodes 3000 --ess-threshold 0.5",
                              "--method weighted --nodes 3000", "--method kalman", "--method grid"})
    all.push_back({discrete + options, {}, {}});
  for (const char* arguments :
       {"filter linear-3d --observations L.csv --method kalman-bucy",
        "compare benes benes:h1=0.6 --observations Y.csv --steps 200 --nodes 40",
        "compare noisy.toml noisy.toml:k=1.5 --observations Z.csv --thin tbba --nodes 100 --launches 3",
        "weak heston --horizon 1 --payoff max(s-1,0) --tolerance 1e-5",
        "weak heston --horizon 1 --payoff s --payoff v^2 --average s --discount v --steps 40 --nodes 400 "
        "--richardson",
        "weak heston --horizon 1 --payoff s --steps 10 --thin tbba --nodes 1000 --order tree --launches 20"})
    all.push_back({arguments, {}, {}});
  return all;
}

void prepare(const Workplace& place) {
  simulate_benes(place);
  place.write("noisy.toml",
              "name = \"noisy\"\nconvention = \"ito\"\n[parameters]\nk = 1\n[state]\nx = { initial = 0 "
              "}\n[drift]\nx = \"-k*x\"\n"
              "[diffusion]\nx = [1]\n[observation]\nkind = \"discrete\"\nh = [\"x\"]\n"
              "noise = { law = \"gaussian\", sd = 0.5 }\n");
  output_of(place, "simulate noisy.toml --horizon 20 --steps 2000 --keep 200 --observations Z.csv");
  output_of(place, "simulate linear-3d --horizon 5 --steps 2000 --keep 1000 --observations L.csv");
}

bool has(const Workplace& place, const std::string& name) {
  for (const std::string& file : place.files())
    if (file == name) return true;
  return false;
}

// What `weak` writes holds the seconds that it took: the last column of CSV, a line each of JSON.
std::string without_seconds(const std::string& text, const Kind& kind) {
  if (!kind.arguments.starts_with("weak")) return text;
  std::string kept;
  for (const std::string& line : lines_of(text)) {
    if (line.find("\"seconds\":") != std::string::npos) continue;
    kept += (text.starts_with("{") ? line : line.substr(0, line.rfind(','))) + '\n';
  }
  return kept;
}

// Whether the run, interrupted up to three times, ended as it should.
bool endures(const Workplace& place, Kind& kind, bool json, std::mt19937_64& random) {
  const auto uniform = [&](double high) { return std::uniform_real_distribution<double>(0, high)(random); };
  const std::string result = json ? "out.json" : "out.csv";
  for (const std::string& file : {result, std::string("save")})
    std::filesystem::remove(place.directory() / file);
  for (int attempt = 0; attempt < 20; ++attempt) {
    std::string command =
        fmt::format("{} --quiet --output {} --format {} --checkpoint save --checkpoint-every {}",
                    kind.arguments, result, json ? "json" : "csv", uniform(0.02) + 1e-6);
    const bool threads = kind.arguments.find("method benes") == std::string::npos &&
                         kind.arguments.find("kalman") == std::string::npos &&
                         kind.arguments.find("grid") == std::string::npos;
    if (threads) command += fmt::format(" --threads {}", 1 + random() % 2);
    const bool resumes = has(place, "save");
    if (resumes) command += " --resume save";
    kind.resumed += resumes ? 1 : 0;
    Running run = place.start(command);
    if (attempt < 3) {
      std::this_thread::sleep_for(std::chrono::duration<double>(uniform(1.2 * kind.seconds)));
      run.signal(std::array{SIGKILL, SIGTERM, SIGINT}[random() % 3]);
    }
    const Outcome outcome = run.finish();
    if (outcome.signal != 0) {
      ++kind.stopped;
      continue;
    }
    if (outcome.code != 0) {
      std::fprintf(stderr, "%s\n%s", command.c_str(), outcome.err.c_str());
      return false;
    }
    if (without_seconds(place.read(result), kind) == (json ? kind.json : kind.csv)) return true;
    std::fprintf(stderr, "%s\nended with other bytes\n", command.c_str());
    return false;
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t runs = argc > 1 ? std::stoul(argv[1]) : 25;
  const Workplace place;
  prepare(place);
  std::vector<Kind> all = kinds();
  std::mt19937_64 random(17);
  for (std::size_t r = 0; r < runs; ++r) {
    Kind& kind = all[r % all.size()];
    if (kind.csv.empty()) {
      const auto began = std::chrono::steady_clock::now();
      output_of(place, kind.arguments + " --quiet --output whole.csv");
      kind.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
      output_of(place, kind.arguments + " --quiet --format json --output whole.json");
      kind.csv = without_seconds(place.read("whole.csv"), kind);
      kind.json = without_seconds(place.read("whole.json"), kind);
    }
    ++kind.runs;
    if (!endures(place, kind, r / all.size() % 2 == 1, random)) ++kind.failed;
  }
  std::size_t stopped = 0, resumed = 0, failed = 0;
  std::printf("%6s %8s %8s %7s  arguments\n", "runs", "stopped", "resumed", "failed");
  for (const Kind& k : all) {
    if (k.runs == 0) continue;
    std::printf("%6zu %8zu %8zu %7zu  %s\n", k.runs, k.stopped, k.resumed, k.failed, k.arguments.c_str());
    stopped += k.stopped;
    resumed += k.resumed;
    failed += k.failed;
  }
  std::size_t left = 0;
  for (const std::string& file : place.files()) left += file.ends_with(".tmp") ? 1 : 0;
  std::printf("%6zu %8zu %8zu %7zu  in all; temporary files left: %zu\n", runs, stopped, resumed, failed,
              left);
  return failed == 0 && resumed > 0 ? 0 : 1;
}
