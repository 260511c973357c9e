#include "wienertree/numeric/memory.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>

#include "wienertree/numeric/error.hpp"

namespace wienertree {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double number_in(const char* file) {
  double number = infinity;
  std::ifstream(file) >> number;
  return number > 0 ? number : infinity;
}

// MemAvailable, in kB: free pages, and those of caches that can be dropped.
double machine_has_free() {
  std::ifstream in("/proc/meminfo");
  std::string name, unit;
  for (double kilobytes = 0; in >> name >> kilobytes; std::getline(in, unit))
    if (name == "MemAvailable:") return 1024 * kilobytes;
  return infinity;
}

// Of a container: its limit less what its processes hold, caches of files not among it. The files are absent, or
// hold "max", where there is none.
double group_has_free() {
  const double limit = number_in("/sys/fs/cgroup/memory.max");
  std::ifstream in("/sys/fs/cgroup/memory.stat");
  std::string name;
  for (double bytes = 0; in >> name >> bytes;)
    if (name == "anon") return std::max(0.0, limit - bytes);
  return limit;
}

// What `ulimit` allows this process.
double allowed(decltype(RLIMIT_AS) resource) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return infinity;
  return static_cast<double>(limit.rlim_cur);
}

double usual_limit() {
  constexpr double part = 0.75, unknown = 4e9;
  const double available =
      std::min({machine_has_free(), group_has_free(), allowed(RLIMIT_AS), allowed(RLIMIT_DATA)});
  return std::isfinite(available) ? part * available : unknown;
}

std::atomic<double> limit_that_was_set = 0;

}  // namespace

double memory_limit() {
  static const double usual = usual_limit();
  const double set = limit_that_was_set;
  return set > 0 ? set : usual;
}

void set_memory_limit(double bytes) {
  if (!(bytes > 0) || !std::isfinite(bytes))
    throw InputError("must be a positive number of bytes", "--memory", fmt::format("{}", bytes));
  limit_that_was_set = bytes;
}

std::string bytes_text(double bytes) {
  return bytes < 1e9 ? fmt::format("{:.3g} MB", bytes / 1e6) : fmt::format("{:.3g} GB", bytes / 1e9);
}

void require_memory(double bytes, const std::string& what, const std::string& where) {
  require_memory(bytes, memory_limit(), what, where);
}

void require_memory(double bytes, double limit, const std::string& what, const std::string& where) {
  if (bytes <= limit) return;
  throw InputError(fmt::format("{} needs about {} of memory, over the limit of {}", what, bytes_text(bytes),
                               bytes_text(limit)),
                   where);
}

}  // namespace wienertree
