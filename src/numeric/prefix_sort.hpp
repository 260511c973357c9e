#pragma once
/// Sorting of indices by keys of which the leading bits nearly decide the order.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "wienertree/numeric/buffer.hpp"
#include "wienertree/numeric/parallel.hpp"

namespace wienertree {

/// How an item is made: leading bits of the key above, the index below, so that equal prefixes stand by
/// index.
struct ItemLayout {
  unsigned index_bits = 32;  ///< 1 to 32; the prefix has the others
  std::uint64_t item(std::uint64_t prefix, std::uint32_t index) const { return prefix << index_bits | index; }
  std::uint64_t prefix(std::uint64_t item) const { return item >> index_bits; }
  std::uint32_t index(std::uint64_t item) const {
    return static_cast<std::uint32_t>(item & ((std::uint64_t{1} << index_bits) - 1));
  }
};

/// Sorts items ascending. Up to 16 ascending runs are merged (branches of a tree whose parents were sorted
/// arrive so); anything else goes through a radix sort of the prefixes, 11 bits a pass, which needs the items
/// to stand by ascending index. `scratch` is resized to the number of items and swapped at will.
/// @param threads to work on, if any
void sort_items(Buffer<std::uint64_t>& items, Buffer<std::uint64_t>& scratch, ItemLayout layout,
                ThreadPool* threads = nullptr);

/// Puts items first..last-1 of equal prefix into the order `before(index_a, index_b)`, a strict total order,
/// given items sorted by prefix.
template <class Before>
void settle_range(std::span<std::uint64_t> items, ItemLayout layout, std::size_t first, std::size_t last,
                  Before before) {
  while (first + 1 < last) {
    if (layout.prefix(items[first]) != layout.prefix(items[first + 1])) {
      ++first;
      continue;
    }
    std::size_t end = first + 2;
    while (end < last && layout.prefix(items[end]) == layout.prefix(items[first])) ++end;
    std::sort(items.begin() + static_cast<std::ptrdiff_t>(first),
              items.begin() + static_cast<std::ptrdiff_t>(end),
              [&](std::uint64_t a, std::uint64_t b) { return before(layout.index(a), layout.index(b)); });
    first = end;
  }
}

/// All items. @param threads to work on, if any
template <class Before>
void settle_equal_prefixes(std::span<std::uint64_t> items, ItemLayout layout, Before before,
                           ThreadPool* threads = nullptr) {
  if (threads == nullptr || threads->size() == 1) return settle_range(items, layout, 0, items.size(), before);
  // Cuts between different prefixes: no two tasks meet.
  constexpr std::size_t most_tasks = 64;
  const std::size_t tasks = std::min(most_tasks, 4 * threads->size());
  std::array<std::size_t, most_tasks + 1> cut{};
  for (std::size_t k = 1; k <= tasks; ++k) {
    std::size_t at = std::max(cut[k - 1], items.size() * k / tasks);
    while (at > 0 && at < items.size() && layout.prefix(items[at]) == layout.prefix(items[at - 1])) ++at;
    cut[k] = at;
  }
  threads->for_each(
      tasks, [&](std::size_t k, std::size_t) { settle_range(items, layout, cut[k], cut[k + 1], before); });
}

}  // namespace wienertree
