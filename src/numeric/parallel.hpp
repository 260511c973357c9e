#pragma once
/// A small persistent pool of threads for loops over blocks of nodes.
#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace wienertree {

/// A task may run on any thread: its result must depend on the task only, never on the thread, which is there
/// to choose scratch memory.
/// A pool of size 1 has no thread of its own and runs everything in the caller's.
class ThreadPool {
 public:
  /// @throws InputError if `threads` is 0
  explicit ThreadPool(std::size_t threads = 1);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  std::size_t size() const { return size_; }

  /// Calls body(task, thread) for every task in 0..tasks-1, thread in 0..size()-1, and returns when all are
  /// done. After an exception no task above the one that threw starts, and the exception of the lowest task
  /// that threw is rethrown: the same one for any number of threads. Not to be called from within a body, nor
  /// by two callers at once. Allocates nothing.
  template <class Body>
  void for_each(std::size_t tasks, Body&& body) {
    run(
        tasks,
        [](void* b, std::size_t task, std::size_t thread) {
          (*static_cast<std::remove_reference_t<Body>*>(b))(task, thread);
        },
        const_cast<void*>(static_cast<const void*>(std::addressof(body))));
  }

 private:
  using Call = void (*)(void* body, std::size_t task, std::size_t thread);
  void run(std::size_t tasks, Call call, void* body);

  struct Shared;
  std::unique_ptr<Shared> shared_;
  std::size_t size_;
};

/// body(first, count, block) over n items in blocks of a size that does not depend on the pool, so that what
/// a block leaves behind does not either. Without a pool, in the caller's thread.
template <class Body>
void for_blocks(ThreadPool* threads, std::size_t n, std::size_t block, Body body) {
  const auto one = [&](std::size_t b, std::size_t) { body(b * block, std::min(block, n - b * block), b); };
  const std::size_t blocks = (n + block - 1) / block;
  if (threads != nullptr && blocks > 1)
    threads->for_each(blocks, one);
  else
    for (std::size_t b = 0; b < blocks; ++b) one(b, 0);
}

}  // namespace wienertree
