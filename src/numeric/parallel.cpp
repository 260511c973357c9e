#include "wienertree/numeric/parallel.hpp"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "wienertree/numeric/error.hpp"

namespace wienertree {

struct ThreadPool::Shared {
  std::mutex mutex;
  std::condition_variable start, done;
  std::size_t round = 0, working = 0;  // guarded by the mutex, as is `failure`
  bool closing = false;
  std::exception_ptr failure;

  std::size_t tasks = 0;
  Call call = nullptr;
  void* body = nullptr;
  // Every thread starts with a share of the tasks, the same from loop to loop, so that it finds in its cache
  // what it left there; who is done goes on with the shares of the others. A share has its own cache line.
  struct alignas(64) Share {
    std::atomic<std::size_t> next{0};
    std::size_t end = 0;
  };
  std::vector<Share> shares;
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> failed_task{none};  // the lowest so far
  std::vector<std::thread> threads;

  explicit Shared(std::size_t size) : shares(size) {}

  void share_out() {
    const std::size_t n = shares.size();
    for (std::size_t k = 0; k < n; ++k) {
      shares[k].next.store(tasks * k / n, std::memory_order_relaxed);
      shares[k].end = tasks * (k + 1) / n;
    }
  }

  void work(std::size_t thread) {
    for (std::size_t k = 0; k < shares.size(); ++k) {
      Share& share = shares[(thread + k) % shares.size()];
      for (;;) {
        const std::size_t task = share.next.fetch_add(1, std::memory_order_relaxed);
        if (task >= share.end) break;
        // Tasks below one that failed are all run, so that the lowest failure is found whoever was first.
        if (task > failed_task.load(std::memory_order_relaxed)) break;
        attempt(task, thread);
      }
    }
  }

  void attempt(std::size_t task, std::size_t thread) {
    try {
      call(body, task, thread);
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (task > failed_task.load(std::memory_order_relaxed)) return;
      failed_task.store(task, std::memory_order_relaxed);
      failure = std::current_exception();
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

ThreadPool::ThreadPool(std::size_t threads) : shared_(std::make_unique<Shared>(threads)), size_(threads) {
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
    s.share_out();
    s.failed_task.store(Shared::none, std::memory_order_relaxed);
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
