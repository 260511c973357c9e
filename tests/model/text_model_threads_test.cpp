// Models are made and evaluated from several threads at once.
#include <catch2/catch.hpp>
#include <thread>

#include "model/text_model_support.hpp"

using namespace wienertree;
using namespace wienertree::testing;

TEST_CASE("loading and evaluating in parallel gives what one thread gives", "[threads]") {
  const Model shared = load_model(bundled("heston"));
  const Point expected = field(*shared.fields, 0, {1.1, 0.08});
  std::vector<Point> seen(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < seen.size(); ++i)
    threads.emplace_back([&, i] {
      for (int repeat = 0; repeat < 3; ++repeat) {
        const TextModel own = TextModel::load(bundled("heston"));
        own.analysis();
        seen[i] = field(*own.model().fields, 0, {1.1, 0.08});
        if (field(*shared.fields, 0, {1.1, 0.08}) != expected) seen[i].clear();
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const Point& values : seen) CHECK(values == expected);
}
