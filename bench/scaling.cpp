/// Time and peak memory of the KLV filter against N, n, dimension and threads. Every run is a process of its
/// own, so that its peak is its own.
///
///     build/bench/bench/scaling            (some minutes; 7 GiB for N = 1e7)
///     build/bench/bench/scaling 1e6        up to N = 1e6
///     build/bench/bench/scaling benes 1e5 100 1    one run (model, N, n, threads), to be profiled
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>

#include "papers/benes_problem.hpp"
#include "wienertree/cubature/construct.hpp"

using namespace wienertree;
using namespace wienertree::papers;

namespace {

struct Setting {
  std::string model = "benes";
  std::size_t N = 100'000, n = 20;
  unsigned threads = 1;
};

struct Cost {
  double wall = 0, processor = 0;          ///< seconds
  double base_memory = 0, memory = 0;      ///< bytes: before the first step, and at most
  double children = 0, last_children = 0;  ///< over all steps, and of the last
};

double peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Cost filter_once(const Setting& s) {
  const Model model = bundled_model(s.model);
  const ObservationPath path = simulate(model, 5.0, 20'000, 2'000, 1).observations;
  FilterOptions o;
  o.formula = construct(5, static_cast<int>(model.noise_dimension()));
  o.thinning = {ThinningMethod::tbba, SiteOrder::spatial, 0};
  o.functional = FunctionalMethod::second_order;
  o.nodes = s.N;
  o.threads = s.threads;
  const auto filter = make_filter(model, o);
  const ObservationWindows windows(path, model.observation, model.timing, s.n);
  Cost cost;
  cost.base_memory = peak_bytes();
  const double processor = processor_seconds();
  const auto start = std::chrono::steady_clock::now();
  run(*filter, windows, {});
  cost.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  cost.processor = processor_seconds() - processor;
  cost.memory = peak_bytes();
  cost.children = static_cast<double>(filter->statistics().children);
  cost.last_children = static_cast<double>(filter->posterior().size());
  return cost;
}

Cost in_own_process(const Setting& s) {
  int channel[2];
  if (pipe(channel) != 0) std::exit(1);
  const pid_t child = fork();
  if (child == 0) {
    const Cost cost = filter_once(s);
    const bool written = write(channel[1], &cost, sizeof cost) == sizeof cost;
    _exit(written ? 0 : 1);
  }
  Cost cost;
  const bool got = child > 0 && read(channel[0], &cost, sizeof cost) == sizeof cost;
  close(channel[0]);
  close(channel[1]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!got || status != 0) {
    fmt::print(stderr, "the run with N = {} failed\n", s.N);
    std::exit(1);
  }
  return cost;
}

// The best of a few: other work on the machine only adds.
Cost measure(const Setting& s) {
  Cost best = in_own_process(s);
  for (int k = 1; k < (s.N <= 100'000 ? 5 : 3); ++k) {
    const Cost again = in_own_process(s);
    best.wall = std::min(best.wall, again.wall);
    best.processor = std::min(best.processor, again.processor);
  }
  return best;
}

double row(const Setting& s) {
  const Cost c = measure(s);
  fmt::print("| {} | {:.0e} | {} | {} | {:.3g} | {:.3g} | {:.1f} | {:.0f} |\n", s.model,
             static_cast<double>(s.N), s.n, s.threads, c.wall, c.processor, 1e9 * c.processor / c.children,
             (c.memory - c.base_memory) / c.last_children);
  std::fflush(stdout);
  return c.wall;
}

void heading(const char* what) {
  fmt::print(
      "\n{}\n\n| model | N | n | threads | s | processor s | ns a child | bytes a child |\n"
      "|---|---|---|---|---|---|---|---|\n",
      what);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 5) {
    const Cost c = filter_once({argv[1], static_cast<std::size_t>(std::atof(argv[2])),
                                static_cast<std::size_t>(std::atoi(argv[3])),
                                static_cast<unsigned>(std::atoi(argv[4]))});
    fmt::print("{:.3g} s, {:.1f} ns a child\n", c.wall, 1e9 * c.processor / c.children);
    return 0;
  }
  const double most = argc > 1 ? std::atof(argv[1]) : 1e7;
  if (!(most >= 1e3)) {
    fmt::print(stderr, "usage: scaling [largest N, at least 1e3] | MODEL N n THREADS\n");
    return 2;
  }
  heading("Nodes (degree 5, second-order, TBBA in spatial order)");
  for (double N = 1e3; N <= most * 1.001; N *= 10)
    row({"benes", static_cast<std::size_t>(std::llround(N)), 20, 1});
  heading("Steps");
  for (const std::size_t n : {20, 40, 80, 160}) row({"benes", 100'000, n, 1});
  heading("Dimension: linear-3d has d = 3, p = 2, 13 paths");
  for (const double N : {1e3, 1e4, 1e5}) row({"linear-3d", static_cast<std::size_t>(N), 20, 1});
  heading("Threads");
  const auto large = static_cast<std::size_t>(std::min(most, 1e6));
  const double one = row({"benes", large, 20, 1});
  for (const unsigned threads : {2U, 4U, 8U})
    fmt::print("  {} threads: {:.2f} times one\n", threads, one / row({"benes", large, 20, threads}));
}
