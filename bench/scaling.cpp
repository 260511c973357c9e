/// Time and peak memory of the KLV filter against N, n, dimension and threads. Every run is a process of its
/// own, so that its peak is its own.
///
///     build/bench/bench/scaling            (three minutes; 3 GiB for N = 1e7)
///     build/bench/bench/scaling 1e6        up to N = 1e6
///     build/bench/bench/scaling benes 1e5 100 1    one run (model, N, n, threads), to be profiled
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

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
  double children = 0, most_children = 0;  ///< over all steps, and of one at most
  double full_processor = 0,
         full_children = 0;  ///< of the steps of a full tree, whose memory has all been touched
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
  ObservationWindow window;
  int thinned = 0;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    windows.get(k, window);
    const auto before = filter->statistics().children;
    const double then = processor_seconds();
    filter->advance(window);
    const auto children = static_cast<double>(filter->statistics().children - before);
    // A step is full if its parents were thinned, and so were theirs.
    if (cost.most_children > static_cast<double>(s.N)) ++thinned;
    if (thinned > 1) {
      cost.full_processor += processor_seconds() - then;
      cost.full_children += children;
    }
    cost.most_children = std::max(cost.most_children, children);
  }
  filter->posterior();
  cost.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  cost.processor = processor_seconds() - processor;
  cost.memory = peak_bytes();
  cost.children = static_cast<double>(filter->statistics().children);
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

// The best of some rounds over all settings: other work on the machine only adds, and a machine whose speed
// drifts treats all alike.
std::vector<Cost> measure(const std::vector<Setting>& settings) {
  std::vector<Cost> best;
  for (int round = 0; round < 3; ++round)
    for (std::size_t i = 0; i < settings.size(); ++i) {
      const Cost c = in_own_process(settings[i]);
      if (round == 0) best.push_back(c);
      best[i].wall = std::min(best[i].wall, c.wall);
      best[i].processor = std::min(best[i].processor, c.processor);
      best[i].full_processor = std::min(best[i].full_processor, c.full_processor);
      best[i].memory = std::min(best[i].memory, c.memory);
    }
  return best;
}

std::vector<Cost> table(const char* what, const std::vector<Setting>& settings) {
  fmt::print(
      "\n{}\n\n| model | N | n | threads | s | processor s | ns a child | of a full step | bytes a child |\n"
      "|---|---|---|---|---|---|---|---|---|\n",
      what);
  const std::vector<Cost> cost = measure(settings);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const Setting& s = settings[i];
    const Cost& c = cost[i];
    fmt::print("| {} | {:.0e} | {} | {} | {:.3g} | {:.3g} | {:.1f} | {:.1f} | {:.0f} |\n", s.model,
               static_cast<double>(s.N), s.n, s.threads, c.wall, c.processor, 1e9 * c.processor / c.children,
               1e9 * c.full_processor / c.full_children, (c.memory - c.base_memory) / c.most_children);
  }
  std::fflush(stdout);
  return cost;
}

// How far from linear: where time is, every cost equals their geometric mean.
template <class CostOf>
void tell_spread(const char* what, const std::vector<Cost>& costs, CostOf cost_of) {
  double log_mean = 0, least = INFINITY, most = 0;
  for (const Cost& c : costs) {
    log_mean += std::log(cost_of(c)) / static_cast<double>(costs.size());
    least = std::min(least, cost_of(c));
    most = std::max(most, cost_of(c));
  }
  const double mean = std::exp(log_mean);
  fmt::print("\nns {}: {:.1f} in the mean, from {:+.0f} % to {:+.0f} %\n", what, 1e9 * mean,
             100 * (least / mean - 1), 100 * (most / mean - 1));
}

int run(int argc, char** argv) {
  if (argc == 5) {
    const Cost c = filter_once({argv[1], static_cast<std::size_t>(std::atof(argv[2])),
                                static_cast<std::size_t>(std::atoi(argv[3])),
                                static_cast<unsigned>(std::atoi(argv[4]))});
    fmt::print("{:.3g} s, {:.1f} ns a child, {:.1f} of a full step\n", c.wall, 1e9 * c.processor / c.children,
               1e9 * c.full_processor / c.full_children);
    return 0;
  }
  const double most = argc > 1 ? std::atof(argv[1]) : 1e7;
  if (!(most >= 1e3)) {
    fmt::print(stderr, "usage: scaling [largest N, at least 1e3] | MODEL N n THREADS\n");
    return 2;
  }
  // As many steps as make those of the growing tree, 3^15 < 1e7, a small part of the whole.
  std::vector<Setting> nodes;
  for (double N = 1e3; N <= most * 1.001; N *= 10)
    nodes.push_back({"benes", static_cast<std::size_t>(std::llround(N)), 40, 1});
  const std::vector<Cost> of_nodes = table("Nodes (degree 5, second-order, TBBA in spatial order)", nodes);
  tell_spread("of a full step", of_nodes, [](const Cost& c) { return c.full_processor / c.full_children; });
  const std::vector<Cost> of_steps = table("Steps", {{"benes", 100'000, 20, 1},
                                                     {"benes", 100'000, 40, 1},
                                                     {"benes", 100'000, 80, 1},
                                                     {"benes", 100'000, 160, 1}});
  tell_spread("a child", of_steps, [](const Cost& c) { return c.processor / c.children; });
  table("Dimension: linear-3d has d = 3, p = 2, 13 paths",
        {{"linear-3d", 1'000, 20, 1}, {"linear-3d", 10'000, 20, 1}, {"linear-3d", 100'000, 20, 1}});
  const auto large = static_cast<std::size_t>(std::min(most, 1e6));
  const std::vector<Cost> threads = table(
      "Threads",
      {{"benes", large, 40, 1}, {"benes", large, 40, 2}, {"benes", large, 40, 4}, {"benes", large, 40, 8}});
  fmt::print("\n2 threads: {:.2f} times one; 4: {:.2f}; 8: {:.2f}\n", threads[0].wall / threads[1].wall,
             threads[0].wall / threads[2].wall, threads[0].wall / threads[3].wall);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& e) {
    fmt::print(stderr, "scaling: {}\n", e.what());
    return 2;
  }
}
