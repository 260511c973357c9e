// The pool of threads.
#include "wienertree/numeric/parallel.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/masses.hpp"
#include "wienertree/thinning/tbba.hpp"

using namespace wienertree;

TEST_CASE("Every task runs once, for any number of threads, round after round", "[threads]") {
  for (const std::size_t threads : {1U, 2U, 3U, 8U}) {
    ThreadPool pool(threads);
    CHECK(pool.size() == threads);
    for (std::size_t tasks = 0; tasks < 200; ++tasks) {
      std::vector<int> runs(tasks);
      std::atomic<bool> thread_in_range{true};
      pool.for_each(tasks, [&](std::size_t task, std::size_t thread) {
        ++runs[task];
        if (thread >= threads) thread_in_range = false;
      });
      REQUIRE(runs == std::vector<int>(tasks, 1));
      REQUIRE(thread_in_range);
    }
  }
}

TEST_CASE("No two tasks share a thread number at one time", "[threads]") {
  ThreadPool pool(4);
  std::vector<std::atomic<int>> busy(4);
  std::atomic<bool> shared{false};
  pool.for_each(2000, [&](std::size_t, std::size_t thread) {
    if (busy[thread].fetch_add(1) != 0) shared = true;
    busy[thread].fetch_sub(1);
  });
  CHECK_FALSE(shared);
}

TEST_CASE("The exception of the lowest failing task comes out, and the pool lives on", "[threads]") {
  for (const std::size_t threads : {1U, 2U, 4U}) {
    ThreadPool pool(threads);
    for (int round = 0; round < 100; ++round) {
      std::string message;
      try {
        pool.for_each(50, [](std::size_t task, std::size_t) {
          if (task % 10 == 7) throw std::runtime_error("task " + std::to_string(task));
        });
      } catch (const std::runtime_error& e) {
        message = e.what();
      }
      REQUIRE(message == "task 7");
      std::atomic<int> ran{0};
      pool.for_each(20, [&](std::size_t, std::size_t) { ++ran; });
      REQUIRE(ran == 20);
    }
  }
}

TEST_CASE("A pool needs a thread", "[threads]") { CHECK_THROWS_AS(ThreadPool(0), InputError); }

TEST_CASE("TBBA by blocks is TBBA, bit for bit", "[threads]") {
  for (const std::size_t sites : {1U, 63U, 64U, 65U, 1000U, 20011U})
    for (const std::uint64_t N : {1ULL, 30ULL, 5000ULL, 100000ULL})
      for (const double spread : {0.0, 1.0, 20.0}) {
        std::vector<double> log_weight(sites);
        RandomStream{1}.normals(0, log_weight);
        for (double& l : log_weight) l *= spread;
        ParticleMasses m;
        assign_masses(log_weight, N, m);
        std::vector<std::uint32_t> whole(sites), blocks(sites);
        TbbaRemainder all{N << m.fraction_bits, false};
        tbba(m.mass, m.fraction_bits, {2}, 0, all, whole);
        for (const std::size_t threads : {1U, 2U, 3U, 5U}) {
          ThreadPool pool(threads);
          tbba(m.mass, m.fraction_bits, {2}, pool, blocks);
          REQUIRE(blocks == whole);
        }
      }
}
