#include "wienertree/numeric/memory.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <sstream>

#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/read_all.hpp"

using namespace wienertree;

TEST_CASE("what is over the limit of memory is refused with both numbers") {
  const double usual = memory_limit();
  CHECK((usual > 1e6 && usual < 1e15));
  CHECK_NOTHROW(require_memory(usual, "it", "here"));
  CHECK_THROWS_WITH(require_memory(2.5e9, 1e9, "a cloud of 7 nodes", "--nodes"),
                    "--nodes: a cloud of 7 nodes needs about 2.5 GB of memory, over the limit of 1 GB");
  set_memory_limit(3e6);
  CHECK(memory_limit() == 3e6);
  CHECK_THROWS_AS(require_memory(4e6, "it", "here"), InputError);
  CHECK_THROWS_AS(require_memory(std::numeric_limits<double>::infinity(), "it", "here"), InputError);
  for (const double wrong : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(set_memory_limit(wrong), InputError);
  set_memory_limit(usual);
}

TEST_CASE("a file is read whole up to a size") {
  std::istringstream in(std::string(100'000, 'x'));
  CHECK(read_all(in, 100'000, "f").size() == 100'000);
  std::istringstream more(std::string(100'001, 'x'));
  CHECK_THROWS_WITH(read_all(more, 100'000, "f"), "f: is too large: it has more than 100000 bytes");
}
