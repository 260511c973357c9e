/// A filter's step does not allocate: thinning reuses its memory.
#include <catch2/catch.hpp>

#include "allocations.hpp"
#include "thinning/recombination_clouds.hpp"

using namespace wienertree;
using namespace wienertree::recombination_test;

TEST_CASE("No allocation after the first call") {
  for (const std::size_t d : {1, 2, 3}) {
    Cloud c = normal_cloud(d, 2000, 41);
    if (d == 3)  // the rank-deficient way as well
      for (std::size_t j = 0; j < 1000; ++j) c.x(2, j) = c.x(1, j) = c.x(0, j);
    const auto thinning = make_recombination(0);
    Selection s;
    thinning->thin(c.sites(), 150, {}, s);
    const std::size_t before = test::allocations();
    thinning->thin(c.sites(), 150, {}, s);
    REQUIRE(test::allocations() == before);
  }
}
