// A thinning on a pool of threads gives the same bytes as in one: every method, orders, dimensions, and sites
// that arrive unsorted, in sorted runs all of positive weight, and with equal states.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "wienertree/thinning/thinning.hpp"

using namespace wienertree;

namespace {

constexpr std::size_t n = 150'000;  // several blocks and radix slices
#ifdef __SANITIZE_THREAD__
constexpr std::size_t numbers_of_threads[] = {3};  // which takes thirty times as long
#else
constexpr std::size_t numbers_of_threads[] = {2, 3, 8};
#endif

struct Cloud {
  Batch x;
  std::vector<double> log_weight = std::vector<double>(n);
};

enum class Kind { unsorted, sorted_runs, equal_states };

Cloud make_cloud(std::size_t d, Kind kind) {
  Cloud c;
  c.x.reshape(d, n);
  for (std::size_t i = 0; i < d; ++i)
    RandomStream{7, 0, static_cast<std::uint32_t>(i)}.normals(0, c.x.component(i));
  RandomStream{8, 0, 0}.normals(0, c.log_weight);
  if (kind != Kind::sorted_runs)
    for (std::size_t k = 0; k < n; k += 97) c.log_weight[k] = -INFINITY;
  const auto x = c.x.component(0);
  if (kind == Kind::sorted_runs)
    for (std::size_t r = 0; r < 3; ++r)
      std::sort(x.begin() + static_cast<std::ptrdiff_t>(r * n / 3),
                x.begin() + static_cast<std::ptrdiff_t>((r + 1) * n / 3));
  if (kind == Kind::equal_states)
    for (double& v : x) v = std::round(v);
  return c;
}

}  // namespace

TEST_CASE("thinning on threads: the same bytes for any number of them", "[threads]") {
  for (const ThinningMethod method : {ThinningMethod::none, ThinningMethod::tbba, ThinningMethod::systematic,
                                      ThinningMethod::recombination})
    for (const SiteOrder order : {SiteOrder::tree, SiteOrder::spatial})
      for (const std::size_t d : {1, 2})
        for (const Kind kind : {Kind::unsorted, Kind::sorted_runs, Kind::equal_states}) {
          if (method == ThinningMethod::recombination && order == SiteOrder::tree) continue;
          CAPTURE(static_cast<int>(method), static_cast<int>(order), d, static_cast<int>(kind));
          const Cloud c = make_cloud(d, kind);
          const auto thinning = make_thinning({method, order});
          Selection alone, together;
          thinning->thin({c.x, c.log_weight, n / 3}, 40'000, {5, 0, 1}, alone);
          for (const std::size_t threads : numbers_of_threads) {
            ThreadPool pool(threads);
            thinning->thin({c.x, c.log_weight, n / 3, &pool}, 40'000, {5, 0, 1}, together);
            REQUIRE(together.site == alone.site);
            REQUIRE(together.count == alone.count);
            REQUIRE(together.log_weight == alone.log_weight);
          }
        }
}
