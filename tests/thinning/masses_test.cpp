// Weights as integers: exact totals, and no integer far from its weight.
#include "wienertree/thinning/masses.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "wienertree/numeric/error.hpp"
#include "wienertree/numeric/random.hpp"

using namespace wienertree;

namespace {

// The documented bound, in units; the heaviest site is checked against its looser one.
void require_close(const std::vector<double>& log_weight, const ParticleMasses& m) {
  const long double largest = *std::max_element(log_weight.begin(), log_weight.end());
  long double sum = 0;
  for (const double l : log_weight) sum += std::exp(static_cast<long double>(l) - largest);
  const long double all = std::ldexp(static_cast<long double>(m.particles), m.fraction_bits);
  std::uint64_t total = 0;
  std::size_t heaviest = static_cast<std::size_t>(
      std::find(log_weight.begin(), log_weight.end(), static_cast<double>(largest)) - log_weight.begin());
  for (std::size_t i = 0; i < log_weight.size(); ++i) {
    const long double owed = std::exp(static_cast<long double>(log_weight[i]) - largest) / sum * all;
    const long double slack = i == heaviest
                                  ? static_cast<long double>(log_weight.size()) / 2 + std::ldexp(all, -48)
                                  : 0.5L + std::ldexp(owed, -48);
    REQUIRE(std::abs(static_cast<long double>(m.mass[i]) - owed) <= slack);
    total += m.mass[i];
  }
  REQUIRE(total == m.particles << m.fraction_bits);
  REQUIRE(m.chunk_mass.size() == (m.mass.size() + ParticleMasses::chunk - 1) / ParticleMasses::chunk);
  for (std::size_t c = 0; c < m.chunk_mass.size(); ++c) {
    const auto first = m.mass.begin() + static_cast<std::ptrdiff_t>(c * ParticleMasses::chunk);
    const auto rest = m.mass.end() - first;
    REQUIRE(std::accumulate(first, first + std::min<std::ptrdiff_t>(ParticleMasses::chunk, rest),
                            std::uint64_t{0}) == m.chunk_mass[c]);
  }
  REQUIRE(std::abs(m.log_total - static_cast<double>(largest + std::log(sum))) <=
          1e-14 + 1e-15 * std::abs(m.log_total));
}

}  // namespace

TEST_CASE("Masses sum to N exactly and keep to the weights") {
  std::vector<double> z(5000);
  RandomStream{1}.normals(0, z);
  ParticleMasses m;
  for (const std::size_t sites : {1U, 2U, 7U, 8U, 9U, 127U, 128U, 129U, 5000U})
    for (const double spread : {0.0, 1e-12, 1.0, 30.0, 1000.0})
      for (const double shift : {0.0, 1e6, -1e6}) {
        std::vector<double> l(sites);
        for (std::size_t i = 0; i < sites; ++i) l[i] = shift + spread * z[i];
        for (const std::uint64_t N : {1ULL, 2ULL, 3ULL, 1000ULL, 123456789ULL, 4294967295ULL}) {
          assign_masses(l, N, m);
          REQUIRE(m.particles << m.fraction_bits >= std::uint64_t{1} << 62);
          REQUIRE(m.particles << m.fraction_bits < std::uint64_t{1} << 63);
          require_close(l, m);
        }
      }
}

TEST_CASE("Weights that add up beyond the range of doubles in either direction") {
  ParticleMasses m;
  assign_masses(std::vector<double>{1e6, 1e6, 1e6 - std::log(2.0), -1e6, -INFINITY}, 5, m);
  const std::uint64_t all = std::uint64_t{5} << m.fraction_bits;
  CHECK(m.mass[0] == Approx(0.4 * static_cast<double>(all)).epsilon(1e-9));  // the ulp of 1e6 is 1e-10
  CHECK(m.mass[3] == 0);
  CHECK(m.mass[4] == 0);
  CHECK(m.log_total == 1e6 + std::log(2.5));
  assign_masses(std::vector<double>(4, -1e308), 4, m);
  CHECK(m.mass == Buffer<std::uint64_t>(4, std::uint64_t{1} << m.fraction_bits));
}

TEST_CASE("Weights that are no weights are refused, with the site and the value") {
  ParticleMasses m;
  const auto message = [&](std::vector<double> l) -> std::string {
    try {
      assign_masses(l, 10, m);
    } catch (const RunError& e) {
      return e.what();
    }
    return "accepted";
  };
  CHECK(message({-INFINITY, -INFINITY}) == "thinning: no site has a positive weight (2 sites)");
  CHECK(message({}) == "thinning: no site has a positive weight (0 sites)");
  CHECK_THAT(message({0, 1, NAN, 2}), Catch::Contains("site 2 of 4") && Catch::Contains("nan"));
  CHECK_THAT(message({0, 1, -NAN, 2}), Catch::Contains("site 2 of 4"));
  CHECK_THAT(message({-INFINITY, INFINITY}), Catch::Contains("site 1 of 2") && Catch::Contains("inf"));
  std::vector<double> many(1000, 0.0);
  for (const std::size_t at : {0U, 500U, 992U, 999U}) {
    many[at] = NAN;
    CHECK_THAT(message(many), Catch::Contains("site " + std::to_string(at) + " of 1000"));
    many[at] = 0;
  }
}

TEST_CASE("Numbers of particles that cannot be counted are refused") {
  ParticleMasses m;
  CHECK_THROWS_AS(assign_masses(std::vector<double>{0}, 0, m), InputError);
  CHECK_THROWS_AS(assign_masses(std::vector<double>{0}, std::uint64_t{1} << 32, m), InputError);
}

TEST_CASE("A mass is split without loss") {
  const std::vector<double> lambda = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  std::vector<std::uint64_t> child(3);
  for (const std::uint64_t mass : {0ULL, 1ULL, 5ULL, 1000003ULL, (1ULL << 62) + 12345, (1ULL << 63) - 1}) {
    split_mass(mass, lambda, child);
    CHECK(child[0] + child[1] + child[2] == mass);
    for (std::size_t j = 0; j < 3; ++j)
      CHECK(std::abs(static_cast<long double>(child[j]) - static_cast<long double>(mass) * lambda[j]) <=
            3 + std::ldexp(static_cast<long double>(mass), -50));
  }
}
