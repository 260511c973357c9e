#include "wienertree/tree/parallel.hpp"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "wienertree/model/error.hpp"

namespace wienertree {

struct ThreadPool::Shared {
  std::mutex mutex;
  std::condition_variable start, done;
  std::size_t round = 0, working = 0;  // guarded by the mutex, as are `failed_task` and `failure`
  bool closing = false;
  std::size_t failed_task = 0;
  std::exception_ptr failure;

  std::size_t tasks = 0;
  Call call = nullptr;
  void* body = nullptr;
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;

  void work(std::size_t thread) {
    for (;;) {
      const std::size_t task = next.fetch_add(1, std::memory_order_relaxed);
      if (task >= tasks) return;
      try {
        call(body, task, thread);
      } catch (...) {
        // Lower tasks have all started and will finish, so the lowest failure is found whoever was first.
        next.store(tasks, std::memory_order_relaxed);
        const std::lock_guard lock(mutex);
        if (failure == nullptr || task < failed_task) {
          failure = std::current_exception();
          failed_task = task;
        }
      }
    }
  }

  void serve(std::size_t thread) {
    for (std::size_t seen = 0;;) {
      {
        std::unique_lock lock(mutex);
        start.wait(lock, [&] { return closing || round != seen; });
        if (closing) return;
        seen = round;
      }
      work(thread);
      const std::lock_guard lock(mutex);
      if (--working == 0) done.notify_one();
    }
  }

  void close() {
    {
      const std::lock_guard lock(mutex);
      closing = true;
    }
    start.notify_all();
    for (std::thread& t : threads) t.join();
  }
};

ThreadPool::ThreadPool(std::size_t threads) : shared_(std::make_unique<Shared>()), size_(threads) {
  if (threads < 1) throw InputError("at least one thread is needed", "threads", "0");
  try {
    for (std::size_t t = 1; t < threads; ++t)
      shared_->threads.emplace_back([shared = shared_.get(), t] { shared->serve(t); });
  } catch (...) {
    shared_->close();
    throw;
  }
}

ThreadPool::~ThreadPool() { shared_->close(); }

void ThreadPool::run(std::size_t tasks, Call call, void* body) {
  if (size_ == 1 || tasks <= 1) {
    for (std::size_t task = 0; task < tasks; ++task) call(body, task, 0);
    return;
  }
  Shared& s = *shared_;
  {
    const std::lock_guard lock(s.mutex);
    s.tasks = tasks;
    s.call = call;
    s.body = body;
    s.next.store(0, std::memory_order_relaxed);
    s.failure = nullptr;
    s.working = s.threads.size();
    ++s.round;
  }
  s.start.notify_all();
  s.work(0);
  std::unique_lock lock(s.mutex);
  s.done.wait(lock, [&] { return s.working == 0; });
  if (s.failure != nullptr) std::rethrow_exception(std::exchange(s.failure, nullptr));
}

}  // namespace wienertree
