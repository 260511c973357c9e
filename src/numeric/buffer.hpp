#pragma once
/// Memory for nodes by the million.
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace wienertree {

/// New elements have no value: what is about to be overwritten need not be written first by the one thread
/// that makes room for all.
template <class T>
struct UnwrittenAllocator : std::allocator<T> {
  UnwrittenAllocator() = default;
  template <class U>
  UnwrittenAllocator(const UnwrittenAllocator<U>&) {}  // NOLINT: as the standard asks of allocators
  template <class U>
  struct rebind {
    using other = UnwrittenAllocator<U>;
  };
  template <class U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

/// A vector of numbers whose new elements have no value until they are written.
template <class T>
using Buffer = std::vector<T, UnwrittenAllocator<T>>;

/// Sets the size; values are unspecified afterwards. A vector that must grow gets twice the room: what is
/// never written costs addresses, not memory.
template <class Vector>
void resize_unspecified(Vector& v, std::size_t n) {
  if (n > v.capacity()) {
    v = Vector();
    v.reserve(2 * n);
  }
  v.resize(n);
}

}  // namespace wienertree
