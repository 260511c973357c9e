#pragma once
/// Sorting of indices by keys of which the 32 leading bits nearly decide the order.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "wienertree/tree/parallel.hpp"

namespace wienertree {

/// An item: 32 leading bits of the key above, the index below, so that equal prefixes stand by index.
inline std::uint64_t packed_item(std::uint32_t prefix, std::uint32_t index) {
  return std::uint64_t{prefix} << 32 | index;
}

/// Sorts items ascending. Up to 8 ascending runs are merged (branches of a tree whose parents were sorted
/// arrive so); anything else goes through a radix sort of the prefixes, 11 bits a pass, which needs the items
/// to stand by ascending index. `scratch` is resized to the number of items and swapped at will.
/// @param threads to work on, if any
void sort_items(std::vector<std::uint64_t>& items, std::vector<std::uint64_t>& scratch,
                ThreadPool* threads = nullptr);

/// Puts items first..last-1 of equal prefix into the order `before(index_a, index_b)`, a strict total order,
/// given items sorted by prefix.
template <class Before>
void settle_range(std::span<std::uint64_t> items, std::size_t first, std::size_t last, Before before) {
  while (first + 1 < last) {
    if (items[first] >> 32 != items[first + 1] >> 32) {
      ++first;
      continue;
    }
    std::size_t end = first + 2;
    while (end < last && items[end] >> 32 == items[first] >> 32) ++end;
    std::sort(items.begin() + static_cast<std::ptrdiff_t>(first),
              items.begin() + static_cast<std::ptrdiff_t>(end), [&](std::uint64_t a, std::uint64_t b) {
                return before(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
              });
    first = end;
  }
}

/// All items. @param threads to work on, if any
template <class Before>
void settle_equal_prefixes(std::span<std::uint64_t> items, Before before, ThreadPool* threads = nullptr) {
  if (threads == nullptr || threads->size() == 1) return settle_range(items, 0, items.size(), before);
  // Cuts between different prefixes: no two tasks meet.
  constexpr std::size_t most_tasks = 64;
  const std::size_t tasks = std::min(most_tasks, 4 * threads->size());
  std::array<std::size_t, most_tasks + 1> cut{};
  for (std::size_t k = 1; k <= tasks; ++k) {
    std::size_t at = std::max(cut[k - 1], items.size() * k / tasks);
    while (at > 0 && at < items.size() && items[at] >> 32 == items[at - 1] >> 32) ++at;
    cut[k] = at;
  }
  threads->for_each(tasks,
                    [&](std::size_t k, std::size_t) { settle_range(items, cut[k], cut[k + 1], before); });
}

}  // namespace wienertree
