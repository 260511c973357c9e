#pragma once
/// Memory of a tree that grows: what is about to be overwritten need not be copied, nor be written first by
/// the one thread that makes room for all. Both cost page faults, which no other thread shares.
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace wienertree {

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

/// Sets the size; values are unspecified afterwards. A vector that must grow again gets twice the room.
template <class Vector>
void resize_unspecified(Vector& v, std::size_t n) {
  if (n > v.capacity()) {
    const std::size_t room = v.capacity() == 0 ? n : 2 * n;
    v = Vector();
    v.reserve(room);
  }
  v.resize(n);
}

}  // namespace wienertree
