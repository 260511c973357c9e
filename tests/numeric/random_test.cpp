// Draws: the published bijection, laws and independence. Seeds are fixed, so a test either always passes or
// never; the false-alarm rate is that of the choice of seed.
#include "wienertree/numeric/random.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "numeric/statistics.hpp"
#include "wienertree/numeric/elementary.hpp"
#include "wienertree/numeric/philox.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

std::vector<double> uniforms(const RandomStream& s, std::size_t n, std::uint64_t first = 0) {
  std::vector<double> u(n);
  s.uniforms(first, u);
  return u;
}

// sqrt(n) times the sample correlation of two independent sequences is asymptotically N(0,1).
double scaled_correlation(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag = 0) {
  const std::size_t n = a.size() - lag;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += (a[i] - 0.5) * (b[i + lag] - 0.5);
  return 12 * sum / std::sqrt(static_cast<double>(n));
}

double ulps(double got, long double exact) {
  const double e = std::abs(static_cast<double>(exact));
  return static_cast<double>(std::abs(static_cast<long double>(got) - exact)) /
         (std::nextafter(e, INFINITY) - e);
}

}  // namespace

TEST_CASE("Philox4x32-10 gives the known answers of its authors") {
  // Random123, tests/kat_vectors: counter, key, result.
  struct Known {
    std::array<std::uint32_t, 4> counter;
    std::array<std::uint32_t, 2> key;
    std::array<std::uint32_t, 4> result;
  };
  const std::array<Known, 3> known = {
      {{{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
       {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
        {0xffffffff, 0xffffffff},
        {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
       {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
        {0xa4093822, 0x299f31d0},
        {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}}}};
  for (const auto& [c, key, r] : known) {
    const PhiloxStream stream{key, 0, c[2], c[3]};
    const std::uint64_t counter = std::uint64_t{c[1]} << 32 | c[0];
    PhiloxBlock block;
    philox(stream, counter, block);
    CHECK(block.low[0] == (std::uint64_t{r[1]} << 32 | r[0]));
    CHECK(block.high[0] == (std::uint64_t{r[3]} << 32 | r[2]));
  }
}

TEST_CASE("Philox by vectors equals Philox by Random123's scalar code, whatever the counter") {
  std::uint64_t x = 1;
  const auto next = [&] { return x = x * 6364136223846793005 + 1442695040888963407; };
  for (int k = 0; k < 1000; ++k) {
    const PhiloxStream stream{
        {static_cast<std::uint32_t>(next() >> 32), static_cast<std::uint32_t>(next() >> 32)},
        static_cast<std::uint32_t>(next() >> 32),
        static_cast<std::uint32_t>(next() >> 32),
        static_cast<std::uint32_t>(next() >> 32)};
    // Every other block crosses a carry into the upper word of the counter.
    const std::uint64_t first = k % 2 == 0 ? next() : (next() & ~std::uint64_t{0xffffffff}) - 5;
    for (const PhiloxKernel kernel : philox_kernels()) {
      PhiloxBlock block;
      kernel(stream, first, block);
      for (std::size_t c = 0; c < philox_block; ++c) {
        const auto [low, high] = philox(stream, first + c);
        REQUIRE(block.low[c] == low);
        REQUIRE(block.high[c] == high);
      }
    }
  }
}

TEST_CASE("A draw depends on its number only, not on how many are taken at once") {
  const RandomStream s{42, 3, 7, Purpose::euler_noise};
  using Fill = void (RandomStream::*)(std::uint64_t, std::span<double>) const;
  for (const Fill fill :
       {Fill{&RandomStream::uniforms}, Fill{&RandomStream::normals}, Fill{&RandomStream::exponentials}}) {
    std::vector<double> all(300);
    (s.*fill)(0, all);
    for (const std::size_t first : {0U, 1U, 2U, 17U, 31U, 32U, 33U, 101U})
      for (const std::size_t n : {0U, 1U, 2U, 3U, 31U, 32U, 33U, 64U, 150U}) {
        std::vector<double> part(n);
        (s.*fill)(first, part);
        for (std::size_t i = 0; i < n; ++i) REQUIRE(part[i] == all[first + i]);
      }
  }
  const std::vector<double> u = uniforms(s, 100);
  for (std::size_t i = 0; i < u.size(); ++i) REQUIRE(s.uniform(i) == u[i]);
}

TEST_CASE("Uniform draws are uniform") {
  // H0: 2^20 draws uniform on the multiples (k + 1/2) 2^-52: chi-square over 1024 leading cells, over the
  // 1024 values of the last 10 of the 52 bits, and over 32 x 32 cells of consecutive pairs.
  const std::size_t n = std::size_t{1} << 20;
  const std::vector<double> u = uniforms({2026}, n);
  std::vector<double> leading(1024), trailing(1024), pairs(1024);
  for (std::size_t i = 0; i < n; ++i) {
    REQUIRE((u[i] > 0 && u[i] < 1));
    const auto k = static_cast<std::uint64_t>(std::ldexp(u[i], 52));
    REQUIRE(std::ldexp(static_cast<double>(k) + 0.0, -52) + 0x1.0p-53 == u[i]);
    ++leading[k >> 42];
    ++trailing[k & 1023];
    if (i % 2 == 1)
      ++pairs[static_cast<std::size_t>(u[i] * 32) * 32 + static_cast<std::size_t>(u[i - 1] * 32)];
  }
  const std::vector<double> expected(1024, 1024.0), expected_pairs(1024, 512.0);
  CHECK(chi_square(leading, expected) < chi_square_bound(1023, 3));
  CHECK(chi_square(trailing, expected) < chi_square_bound(1023, 3));
  CHECK(chi_square(pairs, expected_pairs) < chi_square_bound(1023, 3));
}

TEST_CASE("Streams that differ in seed, launch, step or purpose are independent") {
  // H0: 2^16 draws each, correlation 0 at lags -2..2 between any two streams, and within one at lags 1..4.
  const std::size_t n = std::size_t{1} << 16;
  const std::vector<RandomStream> streams = {{1},
                                             {2},
                                             {std::uint64_t{1} << 32},
                                             {1, 1},
                                             {1, 2},
                                             {1, 0, 1},
                                             {1, 0, 2},
                                             {1, 1, 1},
                                             {1, 0, 0, Purpose::signal_noise},
                                             {1, 0, 0, Purpose::euler_noise},
                                             {1, 1, 0, Purpose::path_sampling}};
  std::vector<std::vector<double>> u;
  for (const RandomStream& s : streams) u.push_back(uniforms(s, n));
  const double bound = normal_bound(static_cast<double>(streams.size() * streams.size() * 5));
  for (std::size_t a = 0; a < u.size(); ++a)
    for (std::size_t b = 0; b < u.size(); ++b)
      for (std::size_t lag = a == b ? 1 : 0; lag < (a == b ? 5 : 3); ++lag)
        CHECK(std::abs(scaled_correlation(u[a], u[b], lag)) < bound);
}

TEST_CASE("Draws beyond the 32-bit range differ from those below") {
  const RandomStream s{5};
  CHECK(uniforms(s, 64, 0) != uniforms(s, 64, std::uint64_t{1} << 33));
  CHECK(uniforms(s, 64, 0) != uniforms(s, 64, std::uint64_t{1} << 48));
}

TEST_CASE("Normal draws are standard normal and independent") {
  // H0: 2^20 independent N(0,1). Cells between the 64-quantiles; correlation within pairs, of neighbours, of
  // squares within pairs (variance 4 each); and the numbers beyond 4 on either side (Poisson, mean 33.2).
  const std::size_t n = std::size_t{1} << 20;
  std::vector<double> z(n), cells(64);
  RandomStream{2026, 0, 0, Purpose::signal_noise}.normals(0, z);
  double within = 0, across = 0, squares = 0, high = 0, low = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double p = 0.5 * std::erfc(-z[i] / std::sqrt(2.0));
    ++cells[std::min<std::size_t>(63, static_cast<std::size_t>(64 * p))];
    high += z[i] > 4;
    low += z[i] < -4;
    if (i % 2 == 1) {
      within += z[i] * z[i - 1];
      squares += (z[i] * z[i] - 1) * (z[i - 1] * z[i - 1] - 1) / 2;
    } else if (i > 0) {
      across += z[i] * z[i - 1];
    }
  }
  const double pairs = static_cast<double>(n) / 2;
  CHECK(chi_square(cells, std::vector<double>(64, static_cast<double>(n) / 64)) < chi_square_bound(63, 6));
  CHECK(std::abs(within) / std::sqrt(pairs) < normal_bound(6));
  CHECK(std::abs(across) / std::sqrt(pairs) < normal_bound(6));
  CHECK(std::abs(squares) / std::sqrt(pairs) < normal_bound(6));
  const double tail = 0.5 * std::erfc(4 / std::sqrt(2.0));
  CHECK(std::abs(high / static_cast<double>(n) - tail) < bernstein_bound(tail, static_cast<double>(n), 6));
  CHECK(std::abs(low / static_cast<double>(n) - tail) < bernstein_bound(tail, static_cast<double>(n), 6));
}

TEST_CASE("Normal and exponential draws are the stated functions of the uniforms") {
  const RandomStream s{9, 1, 2, Purpose::mixture_noise};
  std::vector<double> u(10000), z(10000), e(10000);
  s.uniforms(0, u);
  s.normals(0, z);
  s.exponentials(0, e);
  for (std::size_t i = 0; i < u.size(); i += 2) {
    // A few roundings, each half a unit in the last place of a number below 10.
    const double radius = std::sqrt(-2 * std::log(u[i])), angle = 2 * M_PI * u[i + 1];
    REQUIRE(std::abs(z[i] - radius * std::cos(angle)) < 1e-14);
    REQUIRE(std::abs(z[i + 1] - radius * std::sin(angle)) < 1e-14);
    REQUIRE(std::abs(e[i] + std::log(u[i])) <= 4e-16 * (1 + std::abs(e[i])));
  }
}

TEST_CASE("Elementary functions keep to their error bounds") {
  const std::vector<double> u = uniforms({77}, 200000);
  double worst_log = 0, worst_exp = 0, worst_turn = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const double x = std::ldexp(u[i], i % 4 == 0 ? 0 : -static_cast<int>(i % 50));
    worst_log =
        std::max(worst_log, ulps(elementary::log_near_unit(x), std::log(static_cast<long double>(x))));
    const double y = -std::ldexp(u[i], 9 - static_cast<int>(i % 20));
    worst_exp =
        std::max(worst_exp, ulps(elementary::exp_nonpositive(y), std::exp(static_cast<long double>(y))));
    const auto [sine, cosine] = elementary::sine_cosine_of_turn(u[i]);
    const long double angle = 2 * 3.14159265358979323846264338327950288L * static_cast<long double>(u[i]);
    worst_turn =
        std::max({worst_turn, static_cast<double>(std::abs(static_cast<long double>(sine) - std::sin(angle))),
                  static_cast<double>(std::abs(static_cast<long double>(cosine) - std::cos(angle)))});
  }
  CHECK(worst_log < 1.0);
  CHECK(worst_exp < 2.0);
  CHECK(worst_turn < 2.3e-16);
  CHECK(elementary::exp_nonpositive(0.0) == 1.0);
  CHECK(elementary::exp_nonpositive(-INFINITY) == 0.0);
  CHECK(elementary::exp_nonpositive(-1e300) == 0.0);
  CHECK(elementary::log_near_unit(1.0) == 0.0);
}
