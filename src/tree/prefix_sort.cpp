#include "wienertree/tree/prefix_sort.hpp"

#include <array>

namespace wienertree {
namespace {

constexpr std::size_t most_runs = 8;

// Starts of the ascending runs, and the end; 0 if there are more than `most_runs`.
std::size_t find_runs(std::span<const std::uint64_t> items, std::array<std::size_t, most_runs + 1>& start) {
  std::size_t runs = 1;
  start[0] = 0;
  for (std::size_t i = 1; i < items.size(); ++i)
    if (items[i] < items[i - 1]) {
      if (runs == most_runs) return 0;
      start[runs++] = i;
    }
  start[runs] = items.size();
  return runs;
}

// From both ends at once: two chains of selects without a branch to mispredict, and no bounds to test, since
// each end takes half of the items.
void merge(const std::uint64_t* a, std::size_t n_a, const std::uint64_t* b, std::size_t n_b,
           std::uint64_t* out) {
  const std::uint64_t *a_last = a + n_a, *b_last = b + n_b;
  const std::size_t n = n_a + n_b, half = std::min(n_a, n_b);
  std::uint64_t* out_last = out + n;
  for (std::size_t i = 0; i < half; ++i) {
    const bool take_b = *b < *a;
    *out++ = take_b ? *b : *a;
    b += take_b;
    a += !take_b;
    const bool take_last_a = b_last[-1] < a_last[-1];
    *--out_last = take_last_a ? a_last[-1] : b_last[-1];
    a_last -= take_last_a;
    b_last -= !take_last_a;
  }
  std::merge(a, a_last, b, b_last, out);
}

void merge_runs(std::vector<std::uint64_t>& items, std::vector<std::uint64_t>& scratch, std::size_t runs,
                std::array<std::size_t, most_runs + 1>& start) {
  scratch.resize(items.size());
  while (runs > 1) {
    std::size_t merged = 0;
    for (std::size_t r = 0; r < runs; r += 2) {
      const std::size_t first = start[r], middle = start[std::min(r + 1, runs)],
                        last = start[std::min(r + 2, runs)];
      merge(items.data() + first, middle - first, items.data() + middle, last - middle,
            scratch.data() + first);
      start[merged++] = first;
    }
    start[merged] = items.size();
    runs = merged;
    items.swap(scratch);
  }
}

constexpr std::size_t digit_bits = 11, buckets = std::size_t{1} << digit_bits, passes = 3;

void radix_sort(std::vector<std::uint64_t>& items, std::vector<std::uint64_t>& scratch) {
  scratch.resize(items.size());
  const auto digit = [](std::uint64_t item, std::size_t pass) {
    return static_cast<std::size_t>(item >> (32 + pass * digit_bits)) & (buckets - 1);
  };
  std::array<std::array<std::uint32_t, buckets>, passes> place{};
  for (const std::uint64_t item : items)
    for (std::size_t pass = 0; pass < passes; ++pass) ++place[pass][digit(item, pass)];
  for (std::size_t pass = 0; pass < passes; ++pass) {
    if (place[pass][digit(items[0], pass)] == items.size()) continue;
    std::uint32_t below = 0;
    for (std::uint32_t& p : place[pass]) {
      const std::uint32_t here = p;
      p = below;
      below += here;
    }
    for (const std::uint64_t item : items) scratch[place[pass][digit(item, pass)]++] = item;
    items.swap(scratch);
  }
}

}  // namespace

void sort_items(std::vector<std::uint64_t>& items, std::vector<std::uint64_t>& scratch) {
  std::array<std::size_t, most_runs + 1> start;
  const std::size_t runs = items.empty() ? 1 : find_runs(items, start);
  if (runs == 1) return;
  if (runs > 1)
    merge_runs(items, scratch, runs, start);
  else if (items.size() < buckets / 2)
    std::sort(items.begin(), items.end());
  else
    radix_sort(items, scratch);
}

}  // namespace wienertree
