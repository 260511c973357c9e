#pragma once
/// Sorting of indices by keys of which the 32 leading bits nearly decide the order.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace wienertree {

/// An item: 32 leading bits of the key above, the index below, so that equal prefixes stand by index.
inline std::uint64_t packed_item(std::uint32_t prefix, std::uint32_t index) {
  return std::uint64_t{prefix} << 32 | index;
}

/// Sorts items ascending. Up to 8 ascending runs are merged (branches of a tree whose parents were sorted
/// arrive so); anything else goes through a radix sort of the prefixes, 11 bits a pass, which needs the items
/// to stand by ascending index. `scratch` is resized to the number of items and swapped at will.
void sort_items(std::vector<std::uint64_t>& items, std::vector<std::uint64_t>& scratch);

/// Puts items of equal prefix into the order `before(index_a, index_b)`, a strict total order, given items
/// sorted by prefix.
template <class Before>
void settle_equal_prefixes(std::span<std::uint64_t> items, Before before) {
  for (std::size_t first = 0; first + 1 < items.size();) {
    if (items[first] >> 32 != items[first + 1] >> 32) {
      ++first;
      continue;
    }
    std::size_t last = first + 2;
    while (last < items.size() && items[last] >> 32 == items[first] >> 32) ++last;
    std::sort(items.begin() + static_cast<std::ptrdiff_t>(first),
              items.begin() + static_cast<std::ptrdiff_t>(last), [&](std::uint64_t a, std::uint64_t b) {
                return before(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
              });
    first = last;
  }
}

}  // namespace wienertree
