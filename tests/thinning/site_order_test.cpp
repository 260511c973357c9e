// Spatial order: exact on a line, local along a Hilbert curve, robust against what states can be.
#include "wienertree/thinning/site_order.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numeric>

#include "numeric/statistics.hpp"
#include "wienertree/numeric/error.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

struct Cloud {
  Batch x;
  std::vector<double> log_weight;
  Cloud(std::size_t d, std::size_t n, std::uint64_t seed = 1) : x(d, n), log_weight(n) {
    for (std::size_t i = 0; i < d; ++i)
      RandomStream{seed, 0, static_cast<std::uint32_t>(i)}.normals(0, x.component(i));
  }
  Buffer<std::uint32_t> order(SiteOrdering& ordering) const {
    ParticleMasses m;
    assign_masses(log_weight, 100, m);
    Buffer<std::uint32_t> visit;
    ordering.spatial({x, log_weight, 0}, m, visit);
    return visit;
  }
  Buffer<std::uint32_t> order() const {
    SiteOrdering ordering;
    return order(ordering);
  }
  Buffer<std::uint32_t> sorted_by(std::size_t component) const {
    Buffer<std::uint32_t> visit;
    for (std::uint32_t i = 0; i < log_weight.size(); ++i)
      if (log_weight[i] > -INFINITY) visit.push_back(i);
    std::stable_sort(visit.begin(), visit.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return x(component, a) < x(component, b); });
    return visit;
  }
};

// Mean distance between consecutive sites.
double mean_step(const Cloud& c, const Buffer<std::uint32_t>& visit) {
  double sum = 0;
  for (std::size_t k = 1; k < visit.size(); ++k) {
    double square = 0;
    for (std::size_t i = 0; i < c.x.components(); ++i)
      square += std::pow(c.x(i, visit[k]) - c.x(i, visit[k - 1]), 2);
    sum += std::sqrt(square);
  }
  return sum / static_cast<double>(visit.size() - 1);
}

}  // namespace

TEST_CASE("On a line sites are sorted exactly, equal ones by index") {
  SiteOrdering ordering;  // one for all, so that no call leans on fresh buffers
  for (const std::size_t n : {1U, 2U, 3U, 100U, 1023U, 1024U, 5000U, 50000U}) {
    Cloud c(1, n, n);
    CHECK(c.order(ordering) == c.sorted_by(0));
    const Cloud original = c;
    // Ties, and signed zeros that compare equal.
    for (double& x : c.x.component(0)) x = std::round(4 * x) / 4;
    CHECK(c.order(ordering) == c.sorted_by(0));
    // Outliers of either sign, some of little weight, some of much, up to the ends of the range of doubles.
    c = original;
    c.x(0, n / 2) = 1e300;
    c.x(0, n / 3) = -1.7e308;
    c.x(0, n - 1) = 1.7e308;
    c.log_weight[n / 3] = 3;
    CHECK(c.order(ordering) == c.sorted_by(0));
    // Nearly all mass at one point.
    c = original;
    c.x(0, n / 2) = 0.25;
    c.log_weight[n / 2] = 20;
    CHECK(c.order(ordering) == c.sorted_by(0));
    // Differences far below the scale of the values, and subnormal.
    for (const double scale : {1e-15, 1e-300, 1e-320}) {
      c = original;
      for (double& x : c.x.component(0)) x = (scale == 1e-15 ? 1 : 0) + scale * std::round(10 * x);
      CHECK(c.order(ordering) == c.sorted_by(0));
    }
    // Weights that are zero.
    c = original;
    for (std::size_t i = 0; i < n; i += 3) c.log_weight[i] = -INFINITY;
    c.log_weight[n / 2] = 0;
    CHECK(c.order(ordering) == c.sorted_by(0));
  }
}

TEST_CASE("Branches that are sorted or nearly so are merged into the sorted order") {
  for (const std::size_t branches : {1U, 2U, 3U, 5U, 8U, 9U, 20U})
    for (const bool disturbed : {false, true}) {
      const std::size_t parents = 3000;
      Cloud c(1, branches * parents);
      for (std::size_t b = 0; b < branches; ++b) {
        const auto x = c.x.component(0).subspan(b * parents, parents);
        std::sort(x.begin(), x.end());
        if (disturbed && b % 2 == 1) std::swap(x[100], x[101]);
        for (double& value : x) value += 0.3 * static_cast<double>(b);
      }
      CHECK(c.order() == c.sorted_by(0));
    }
  Cloud reversed(1, 5000);
  std::sort(reversed.x.component(0).begin(), reversed.x.component(0).end(), std::greater<>());
  CHECK(reversed.order() == reversed.sorted_by(0));
}

TEST_CASE("Components that do not vary do not count") {
  Cloud c(5, 2000);
  for (const std::size_t i : {0U, 1U, 2U, 4U})
    std::fill(c.x.component(i).begin(), c.x.component(i).end(), 7.5);
  CHECK(c.order() == c.sorted_by(3));
  std::fill(c.x.component(3).begin(), c.x.component(3).end(), -1.0);
  Buffer<std::uint32_t> by_index(2000);
  std::iota(by_index.begin(), by_index.end(), 0U);
  CHECK(c.order() == by_index);
  // A site without weight may differ, even be NaN.
  c.x(2, 77) = NAN;
  c.log_weight[77] = -INFINITY;
  by_index.erase(by_index.begin() + 77);
  CHECK(c.order() == by_index);
}

TEST_CASE("A state of positive weight that is not finite is an error with its site") {
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY)}) {
    Cloud c(3, 50);
    c.x(1, 31) = bad;
    CHECK_THROWS_WITH(c.order(), Catch::Contains("component 1") && Catch::Contains("site 31"));
    CHECK_THROWS_AS(c.order(), RunError);
    c.log_weight[31] = -INFINITY;
    CHECK_NOTHROW(c.order());
  }
}

TEST_CASE("In space neighbours in the order are near, in every dimension") {
  // 4096 points. A random order has mean step about sqrt(2 d); points spaced like a curve through cells of
  // volume 1/n have steps of order n^{-1/d} times the extent, about 6 n^{-1/d} sqrt(d).
  for (const std::size_t d : {2U, 3U, 4U, 6U, 9U, 16U, 33U, 64U}) {
    Cloud c(d, 4096);
    auto visit = c.order();
    const double curve = mean_step(c, visit);
    Buffer<std::uint32_t> sorted = visit;
    std::sort(sorted.begin(), sorted.end());
    Buffer<std::uint32_t> all(4096);
    std::iota(all.begin(), all.end(), 0U);
    CHECK(sorted == all);
    const double root = std::sqrt(2.0 * static_cast<double>(d));
    if (d <= 4) CHECK(curve < 3 * root * std::pow(4096.0, -1.0 / static_cast<double>(d)));
    CHECK(curve < (d <= 9 ? 0.8 : 0.99) * root);
    if (d != 2) continue;
    // An outlier costs the others next to nothing, whether it has weight or not.
    for (const double l : {0.0, -30.0, 4.0}) {
      c.x(0, 9) = 1e9;
      c.x(1, 9) = -1e12;
      c.log_weight[9] = l;
      visit = c.order();
      visit.erase(std::find(visit.begin(), visit.end(), 9U));
      CHECK(mean_step(c, visit) < 1.1 * curve);
    }
  }
}

TEST_CASE("More dimensions than a key has bits are refused") {
  CHECK_THROWS_AS(Cloud(65, 10).order(), InputError);
  Cloud c(70, 10);
  for (std::size_t i = 64; i < 70; ++i) std::fill(c.x.component(i).begin(), c.x.component(i).end(), 1.0);
  CHECK_NOTHROW(c.order());
}

TEST_CASE("Hilbert keys: known answers, one key a cell, neighbours next to each other") {
  HilbertAxes axes{};
  std::array<std::uint64_t, hilbert_block> key;
  // The example of Skilling's program.
  axes[0][0] = 5;
  axes[1][0] = 10;
  axes[2][0] = 20;
  hilbert_keys(axes, 3, 5, key);
  CHECK(key[0] == 7865);
  // The first two curves in the plane: the horseshoe, and four of them.
  const std::vector<std::pair<unsigned, std::vector<std::array<std::uint32_t, 2>>>> planes = {
      {1, {{0, 0}, {0, 1}, {1, 1}, {1, 0}}},
      {2,
       {{0, 0},
        {1, 0},
        {1, 1},
        {0, 1},
        {0, 2},
        {0, 3},
        {1, 3},
        {1, 2},
        {2, 2},
        {2, 3},
        {3, 3},
        {3, 2},
        {3, 1},
        {2, 1},
        {2, 0},
        {3, 0}}}};
  for (const auto& [bits, cells] : planes)
    for (std::size_t k = 0; k < cells.size(); ++k) {
      axes[0][0] = cells[k][0];
      axes[1][0] = cells[k][1];
      hilbert_keys(axes, 2, bits, key);
      CHECK(key[0] == k);
    }

  const std::vector<std::pair<std::size_t, unsigned>> grids = {{1, 6}, {2, 1}, {2, 6}, {3, 4},
                                                               {4, 3}, {5, 2}, {7, 2}, {12, 1}};
  for (const auto& [d, bits] : grids) {
    CAPTURE(d, bits);
    const std::uint64_t cells = std::uint64_t{1} << (d * bits), side = std::uint64_t{1} << bits;
    std::vector<std::vector<std::uint32_t>> at(cells);
    for (std::uint64_t first = 0; first < cells; first += hilbert_block) {
      const std::uint64_t n = std::min<std::uint64_t>(hilbert_block, cells - first);
      std::vector<std::vector<std::uint32_t>> coordinates(n, std::vector<std::uint32_t>(d));
      for (std::size_t l = 0; l < n; ++l)
        for (std::size_t i = 0; i < d; ++i)
          coordinates[l][i] = axes[i][l] = static_cast<std::uint32_t>((first + l) >> (i * bits) & (side - 1));
      hilbert_keys(axes, d, bits, key);
      for (std::size_t l = 0; l < n; ++l) {
        REQUIRE(key[l] < cells);
        REQUIRE(at[key[l]].empty());
        at[key[l]] = coordinates[l];
      }
    }
    bool neighbours = true;
    for (std::uint64_t k = 1; k < cells; ++k) {
      std::uint64_t distance = 0;
      for (std::size_t i = 0; i < d; ++i)
        distance += at[k][i] > at[k - 1][i] ? at[k][i] - at[k - 1][i] : at[k - 1][i] - at[k][i];
      neighbours &= distance == 1;
    }
    CHECK(neighbours);
  }
}

TEST_CASE("Hilbert keys use all 64 bits") {
  HilbertAxes axes{};
  std::array<std::uint64_t, hilbert_block> key;
  // The curve of 2^32 cells a side starts at the origin and ends at the far end of one axis.
  hilbert_keys(axes, 2, 32, key);
  CHECK(key[0] == 0);
  axes = {};
  axes[0][0] = 0xffffffff;
  hilbert_keys(axes, 2, 32, key);
  CHECK(key[0] == ~std::uint64_t{0});
}

TEST_CASE("Thinned in spatial order, the error of a mean falls like 1/N on a line") {
  // Sites: 4 N children of N sorted parents, weights a smooth density; phi(x) = x. Standard deviation of the
  // mean over 200 draws at N = 64 .. 4096. Its logarithm has standard error about 1/sqrt(2 x 200) = 0.05 at
  // each N, the slope over a range of log 64 about 0.05 sqrt(2) / log 64 = 0.02: 0.1 is 5 of them, on each
  // side.
  const std::size_t draws = 200;
  for (const ThinningMethod method : {ThinningMethod::tbba, ThinningMethod::stratified,
                                      ThinningMethod::systematic, ThinningMethod::multinomial})
    for (const SiteOrder order : {SiteOrder::tree, SiteOrder::spatial}) {
      const auto thinning = make_thinning({method, order});
      CAPTURE(std::string(thinning->name()), order == SiteOrder::spatial);
      std::vector<double> log_n, log_sd;
      for (std::size_t N = 64; N <= 4096; N *= 4) {
        Cloud c(1, 4 * N, N);
        for (std::size_t i = 0; i < 4 * N; ++i) c.log_weight[i] = std::sin(3 * c.x(0, i)) - 0.5 * c.x(0, i);
        double sum = 0, square = 0;
        Selection s;
        for (std::uint32_t k = 0; k < draws; ++k) {
          thinning->thin({c.x, c.log_weight, N}, N, {71, 0, k}, s);
          double mean = 0;
          for (std::size_t j = 0; j < s.site.size(); ++j) mean += s.count[j] * c.x(0, s.site[j]);
          mean /= static_cast<double>(N);
          sum += mean;
          square += mean * mean;
        }
        const double R = static_cast<double>(draws);
        log_n.push_back(std::log(static_cast<double>(N)));
        log_sd.push_back(0.5 * std::log(square / R - sum / R * sum / R));
      }
      const double rate = slope(log_n, log_sd);
      if (order == SiteOrder::spatial && method != ThinningMethod::multinomial)
        CHECK(rate < -0.9);
      else if (method != ThinningMethod::systematic)  // whose draws in a random order are not independent
        CHECK(std::abs(rate + 0.5) < 0.1);
    }
}
