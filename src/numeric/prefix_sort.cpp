#include "wienertree/numeric/prefix_sort.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

namespace wienertree {
namespace {

constexpr std::size_t most_runs = 16;

// Starts of the ascending runs, and the end; 0 if there are more than `most_runs`. Descents are counted block
// by block, and looked for only where there is one.
std::size_t find_runs(std::span<const std::uint64_t> items, std::array<std::size_t, most_runs + 1>& start,
                      ThreadPool* threads) {
  constexpr std::size_t block = 4096;
  const auto descents = [&](std::size_t first, std::size_t count) {
    std::size_t found = 0;
    for (std::size_t i = std::max<std::size_t>(first, 1); i < first + count; ++i)
      found += items[i] < items[i - 1] ? 1 : 0;
    return found;
  };
  std::array<std::size_t, most_runs> found_block{};
  std::atomic<std::size_t> blocks_found = 0;
  for_blocks(threads, items.size(), block, [&](std::size_t first, std::size_t count, std::size_t) {
    if (blocks_found.load(std::memory_order_relaxed) > most_runs || descents(first, count) == 0) return;
    const std::size_t k = blocks_found.fetch_add(1, std::memory_order_relaxed);
    if (k < most_runs) found_block[k] = first;
  });
  if (blocks_found > most_runs) return 0;
  const std::span<std::size_t> with_descent(found_block.data(), blocks_found.load());
  for (auto i = with_descent.begin(); i != with_descent.end(); ++i)  // by insertion: they are few
    std::rotate(std::upper_bound(with_descent.begin(), i, *i), i, i + 1);
  std::size_t runs = 1;
  start[0] = 0;
  for (const std::size_t first : with_descent)
    for (std::size_t i = std::max<std::size_t>(first, 1); i < std::min(first + block, items.size()); ++i)
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

// A part of a merge: no item of one part belongs among those of another.
struct MergePart {
  std::size_t first_a, last_a, first_b, last_b;
};

// Runs begin..middle-1 and middle..end-1 in `parts` parts, cut at equal steps of the first run.
MergePart part_of_merge(std::span<const std::uint64_t> items, std::size_t begin, std::size_t middle,
                        std::size_t end, std::size_t part, std::size_t parts) {
  const auto cut_a = [&](std::size_t k) { return begin + (middle - begin) * k / parts; };
  const auto cut_b = [&](std::size_t k) {
    if (k == 0) return middle;
    if (k == parts) return end;
    const auto from = items.begin() + static_cast<std::ptrdiff_t>(middle);
    const auto to = items.begin() + static_cast<std::ptrdiff_t>(end);
    return static_cast<std::size_t>(std::lower_bound(from, to, items[cut_a(k)]) - items.begin());
  };
  return {cut_a(part), cut_a(part + 1), cut_b(part), cut_b(part + 1)};
}

void merge_runs(Buffer<std::uint64_t>& items, Buffer<std::uint64_t>& scratch, std::size_t runs,
                std::array<std::size_t, most_runs + 1>& start, ThreadPool* threads) {
  constexpr std::size_t least_part = 4096;
  resize_unspecified(scratch, items.size());
  while (runs > 1) {
    const std::size_t pairs = (runs + 1) / 2;
    const std::size_t parts =
        threads == nullptr || items.size() < least_part * pairs ? 1 : 2 * threads->size();
    for_blocks(threads, pairs * parts, 1, [&](std::size_t task, std::size_t, std::size_t) {
      const std::size_t r = 2 * (task / parts), begin = start[r], middle = start[std::min(r + 1, runs)];
      const MergePart p =
          part_of_merge(items, begin, middle, start[std::min(r + 2, runs)], task % parts, parts);
      merge(items.data() + p.first_a, p.last_a - p.first_a, items.data() + p.first_b, p.last_b - p.first_b,
            scratch.data() + p.first_a + (p.first_b - middle));
    });
    for (std::size_t k = 0; k < pairs; ++k) start[k] = start[2 * k];
    start[pairs] = items.size();
    runs = pairs;
    items.swap(scratch);
  }
}

constexpr std::size_t digit_bits = 11, buckets = std::size_t{1} << digit_bits;

// Slices of the items are counted and placed side by side: slice k's items of a digit go behind those of the
// slices before it, so that the order does not depend on the number of slices.
void radix_sort(Buffer<std::uint64_t>& items, Buffer<std::uint64_t>& scratch, ItemLayout layout,
                ThreadPool* threads) {
  constexpr std::size_t most_slices = 16, least_slice = std::size_t{1} << 16;
  resize_unspecified(scratch, items.size());
  const std::size_t wanted = threads == nullptr ? 1
                                                : std::clamp(items.size() / least_slice, std::size_t{1},
                                                             std::min(most_slices, threads->size()));
  const std::size_t slice = (items.size() + wanted - 1) / wanted;
  const std::size_t slices = (items.size() + slice - 1) / slice;
  std::array<std::array<std::uint32_t, buckets>, most_slices> place;
  for (std::size_t shift = layout.index_bits; shift < 64; shift += digit_bits) {
    const auto digit = [shift](std::uint64_t item) {
      return static_cast<std::size_t>(item >> shift) & (buckets - 1);
    };
    for_blocks(threads, items.size(), slice, [&](std::size_t first, std::size_t count, std::size_t k) {
      place[k].fill(0);
      for (const std::uint64_t item : std::span(items).subspan(first, count)) ++place[k][digit(item)];
    });
    std::size_t like_first = 0;
    for (std::size_t k = 0; k < slices; ++k) like_first += place[k][digit(items[0])];
    if (like_first == items.size()) continue;
    std::uint32_t below = 0;
    for (std::size_t d = 0; d < buckets; ++d)
      for (std::size_t k = 0; k < slices; ++k) below += std::exchange(place[k][d], below);
    for_blocks(threads, items.size(), slice, [&](std::size_t first, std::size_t count, std::size_t k) {
      for (const std::uint64_t item : std::span(items).subspan(first, count))
        scratch[place[k][digit(item)]++] = item;
    });
    items.swap(scratch);
  }
}

}  // namespace

void sort_items(Buffer<std::uint64_t>& items, Buffer<std::uint64_t>& scratch, ItemLayout layout,
                ThreadPool* threads) {
  std::array<std::size_t, most_runs + 1> start;
  const std::size_t runs = items.empty() ? 1 : find_runs(items, start, threads);
  if (runs == 1) return;
  if (runs > 1)
    merge_runs(items, scratch, runs, start, threads);
  else if (items.size() < buckets / 2)
    std::sort(items.begin(), items.end());
  else
    radix_sort(items, scratch, layout, threads);
}

}  // namespace wienertree
