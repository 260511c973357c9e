// TBBA: what must hold for every input, and its exact law in small cases.
#include "wienertree/thinning/tbba.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "numeric/statistics.hpp"
#include "thinning/exact_tbba.hpp"
#include "wienertree/numeric/error.hpp"
#include "wienertree/thinning/masses.hpp"

using namespace wienertree;
using namespace wienertree_test;

namespace {

std::vector<std::uint32_t> counts_of(const ParticleMasses& m, const RandomStream& random,
                                     std::uint64_t first_draw = 0) {
  std::vector<std::uint32_t> count(m.mass.size());
  TbbaRemainder all{m.particles << m.fraction_bits, false};
  tbba(m.mass, m.fraction_bits, random, first_draw, all, count);
  if (all.mass != 0 || all.extra) FAIL("something remains");
  return count;
}

// Whether sum o = N, and every o is [N g] or [N g] + 1, the latter only if N g is no integer, for the integer
// masses.
bool sound(const ParticleMasses& m, const std::vector<std::uint32_t>& count) {
  std::uint64_t total = 0;
  bool each = true;
  for (std::size_t i = 0; i < count.size(); ++i) {
    const std::uint64_t whole = m.mass[i] >> m.fraction_bits;
    const bool integral = whole << m.fraction_bits == m.mass[i];
    each &= count[i] == whole || (!integral && count[i] == whole + 1);
    total += count[i];
  }
  return each && total == m.particles;
}

// Pearson's statistic of sampled joint outcomes against an exact law; outcomes outside the law fail.
void check_law(const std::map<Counts, double>& observed, const CountLaw& law, double draws,
               double comparisons) {
  std::vector<double> got, expected;
  for (const auto& [counts, p] : law) {
    if (p < 1e-12) continue;  // 1 - p of a certain outcome, rounded
    const auto found = observed.find(counts);
    got.push_back(found == observed.end() ? 0.0 : found->second);
    expected.push_back(draws * p);
  }
  CHECK(std::accumulate(got.begin(), got.end(), 0.0) == draws);
  CHECK(chi_square(got, expected) < chi_square_bound(static_cast<double>(got.size()) - 1, comparisons));
}

double fraction(double x) { return x - std::floor(x); }

std::vector<double> logs(const std::vector<unsigned>& weights) {
  std::vector<double> l;
  for (const unsigned w : weights) l.push_back(std::log(w));
  return l;
}

}  // namespace

TEST_CASE("TBBA is sound on a million weight vectors, nasty ones included") {
  // Weights as the masses round them; masses_test holds the masses to the weights.
  const RandomStream random{11};
  std::vector<double> u(32), log_weight;
  ParticleMasses m;
  std::uint64_t drawn = 0;
  for (std::uint32_t k = 0; k < 1000000; ++k) {
    random.uniforms(drawn, u);
    drawn += u.size();
    const std::size_t sites = 1 + static_cast<std::size_t>(u[0] * (k % 16 == 0 ? 29 : 8));
    const double spread = k % 3 == 0 ? 2 : k % 3 == 1 ? 40 : 800;
    log_weight.resize(sites);
    for (std::size_t i = 0; i < sites; ++i) {
      log_weight[i] = spread * u[i + 2];
      if (k % 5 == 1) log_weight[i] = std::round(u[i + 2]);  // ties
      if (k % 5 == 2) log_weight[i] = 0;                     // equal: integers N g where M divides N
      if (k % 5 == 3 && u[i + 2] < 0.3) log_weight[i] = -INFINITY;
      if (k % 7 == 1 && i > 0) log_weight[i] = std::log(1e-300);  // one takes all
    }
    if (log_weight[0] == -INFINITY) log_weight[0] = 0;
    const auto N = static_cast<std::uint64_t>(std::exp(u[1] * (k % 2 == 0 ? 4 : 22)));
    assign_masses(log_weight, std::max<std::uint64_t>(1, N), m);
    if (!sound(m, counts_of(m, {12, 0, k}))) FAIL("vector " << k);
  }
}

TEST_CASE("TBBA is sound on ten million weights, and on a billion particles") {
  std::vector<double> log_weight(10000000);
  RandomStream{13}.normals(0, log_weight);
  ParticleMasses m;
  for (const std::uint64_t N : {1000ULL, 1000000000ULL}) {
    assign_masses(log_weight, N, m);
    REQUIRE(sound(m, counts_of(m, {14})));
  }
}

TEST_CASE("Equal weights with integer N g get exactly that") {
  for (const std::size_t sites : {1U, 2U, 3U, 7U, 10U, 1000U, 99999U})
    for (const std::uint64_t each : {1U, 2U, 3U, 1000U}) {
      ParticleMasses m;
      assign_masses(std::vector<double>(sites, -0.3), sites * each, m);
      for (const std::uint32_t o : counts_of(m, {15})) REQUIRE(o == each);
    }
}

TEST_CASE("A site without weight is never drawn, a site with all of it always") {
  ParticleMasses m;
  for (std::uint32_t k = 0; k < 1000; ++k) {
    assign_masses(std::vector<double>{-INFINITY, -1e6, 0, -INFINITY, -800, -INFINITY}, 1 + k, m);
    REQUIRE(counts_of(m, {16, 0, k}) == std::vector<std::uint32_t>{0, 0, 1 + k, 0, 0, 0});
  }
}

TEST_CASE("TBBA has the law of the printed algorithm") {
  // H0: joint outcomes follow the enumerated law. 2^16 draws a case; weights that put {G} on both sides of
  // the carry and, exactly, on integers (7 x (62 + 38)/100), with N g above and below 1.
  const double draws = 1 << 16;
  const std::vector<std::pair<std::vector<unsigned>, unsigned>> cases = {{{5, 3, 2}, 1},
                                                                         {{17, 23, 31, 29}, 3},
                                                                         {{5, 41, 7, 19, 28}, 4},
                                                                         {{62, 11, 9, 13, 5}, 7},
                                                                         {{1, 2, 1, 2, 2}, 6}};
  for (const auto& [weights, N] : cases) {
    const CountLaw exact = flat_law(weights, N);
    ParticleMasses m;
    assign_masses(logs(weights), N, m);
    std::map<Counts, double> observed;
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(draws); ++k) {
      const auto count = counts_of(m, {17, N, k});
      ++observed[Counts(count.begin(), count.end())];
    }
    check_law(observed, exact, draws, static_cast<double>(cases.size()));

    // The law itself: means N g, variances {N g}(1 - {N g}), covariances <= 0.
    const double W = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (std::size_t i = 0; i < weights.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        const double owed_i = N * weights[i] / W, owed_j = N * weights[j] / W;
        double mean = 0, product = 0;
        for (const auto& [counts, p] : exact) {
          mean += p * counts[i];
          product += p * (counts[i] - owed_i) * (counts[j] - owed_j);
        }
        CHECK(mean == Approx(owed_i));
        if (i == j)
          CHECK(product == Approx(fraction(owed_i) * (1 - fraction(owed_i))).epsilon(0).margin(1e-12));
        else
          CHECK(product < 1e-12);
      }
  }
}

TEST_CASE("TBBA over a long word keeps means and pairwise covariances") {
  // More sites than one word of the chain. H0: E o_i = N g_i (Bernstein); Cov(o_i, o_{i+1}) <= 0: the sample
  // covariance of 20000 draws lies below the Bernstein bound for products of deviations, which stay within
  // 1 of their means and have variance at most that of one factor.
  const std::size_t sites = 150, draws = 20000;
  std::vector<double> log_weight(sites), mean(sites), neighbours(sites - 1);
  RandomStream{18}.normals(0, log_weight);
  ParticleMasses m;
  assign_masses(log_weight, 60, m);
  for (std::uint32_t k = 0; k < draws; ++k) {
    const auto count = counts_of(m, {19, 0, k});
    for (std::size_t i = 0; i < sites; ++i) mean[i] += count[i];
    for (std::size_t i = 0; i + 1 < sites; ++i)
      neighbours[i] += (count[i] - std::ldexp(static_cast<double>(m.mass[i]), -m.fraction_bits)) *
                       (count[i + 1] - std::ldexp(static_cast<double>(m.mass[i + 1]), -m.fraction_bits));
  }
  const double R = static_cast<double>(draws);
  for (std::size_t i = 0; i < sites; ++i) {
    const double owed = std::ldexp(static_cast<double>(m.mass[i]), -m.fraction_bits), f = fraction(owed);
    CHECK(std::abs(mean[i] / R - owed) < bernstein_bound(f * (1 - f), R, 2 * sites));
    if (i + 1 < sites) CHECK(neighbours[i] / R < bernstein_bound(f * (1 - f), R, 2 * sites));
  }
}

TEST_CASE("Level by level down a tree TBBA has its iterated law") {
  // H0: joint counts of the leaves, family by family, follow the enumerated law. 2^15 draws a case.
  const double draws = 1 << 15;
  struct Tree {
    std::vector<unsigned> first, second;
    unsigned N;
  };
  const std::vector<Tree> trees = {{{4, 6}, {21, 34, 45}, 1},
                                   {{4, 6}, {21, 34, 45}, 3},
                                   {{4, 6}, {21, 34, 45}, 5},
                                   {{3, 5, 2}, {1, 4, 2}, 4},
                                   {{1, 1}, {1, 1, 1}, 3}};
  for (std::uint32_t c = 0; c < trees.size(); ++c) {
    const auto& [first, second, N] = trees[c];
    const auto normalised = [](const std::vector<unsigned>& w) {
      std::vector<double> g;
      for (const unsigned x : w) g.push_back(x / std::accumulate(w.begin(), w.end(), 0.0));
      return g;
    };
    const std::vector<double> g = normalised(first), h = normalised(second);
    const std::size_t a = g.size(), b = h.size();
    ParticleMasses m;
    assign_masses(std::vector<double>{0.0}, N, m);
    const std::vector<std::uint32_t> root = {N};
    std::map<Counts, double> observed;
    std::vector<std::uint64_t> mass(a), leaf_mass(a * b);
    std::vector<std::uint32_t> count(a), leaf_count(a * b);
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(draws); ++k) {
      tbba_level(m.mass, root, g, m.fraction_bits, {20, c, 2 * k}, mass, count);
      tbba_level(mass, count, h, m.fraction_bits, {20, c, 2 * k + 1}, leaf_mass, leaf_count);
      Counts outcome(a * b);
      for (std::size_t i = 0; i < a; ++i)
        for (std::size_t j = 0; j < b; ++j) outcome[b * i + j] = leaf_count[a * j + i];
      ++observed[outcome];
    }
    check_law(observed, iterated_law(first, second, N), draws, static_cast<double>(trees.size()));
  }
}

TEST_CASE("The iterated law is the flat law over the leaves for N = 1 and for families owed whole numbers") {
  const auto agree = [](const CountLaw& p, const CountLaw& q) {
    double difference = 0;
    for (const auto& [counts, x] : p) difference += std::abs(x - (q.contains(counts) ? q.at(counts) : 0.0));
    for (const auto& [counts, x] : q) difference += p.contains(counts) ? 0.0 : x;
    return difference < 1e-9;
  };
  const std::vector<unsigned> a = {4, 6}, b = {21, 34, 45}, leaves = {84, 136, 180, 126, 204, 270};
  CHECK(agree(iterated_law(a, b, 1), flat_law(leaves, 1)));
  CHECK(agree(iterated_law(a, b, 5), flat_law(leaves, 5)));  // the families are owed 2 and 3
  // Not in general: 3 particles on two families of three leaves owed 1/2 each. Flat TBBA settles leaves in
  // pairs (1,2), (3,4), (5,6); the iterated form settles (2,3) and (5,6) within their families, and 1
  // against 4.
  const CountLaw flat = flat_law({1, 1, 1, 1, 1, 1}, 3), iterated = iterated_law({1, 1}, {1, 1, 1}, 3);
  CHECK_FALSE(agree(flat, iterated));
  for (const auto& [o, p] : flat)
    if (p > 1e-12) CHECK((o[0] + o[1] == 1 && o[2] + o[3] == 1 && o[4] + o[5] == 1));
  for (const auto& [o, p] : iterated)
    if (p > 1e-12) CHECK((o[0] + o[3] == 1 && o[1] + o[2] == 1 && o[4] + o[5] == 1));
  // The counts of single leaves have the same law all the same.
  for (std::size_t i = 0; i < 6; ++i) {
    double p_flat = 0, p_iterated = 0;
    for (const auto& [o, p] : flat) p_flat += p * o[i];
    for (const auto& [o, p] : iterated) p_iterated += p * o[i];
    CHECK(p_flat == Approx(0.5));
    CHECK(p_iterated == Approx(0.5));
  }
}

TEST_CASE("The iterated form goes down deep trees: totals, and one particle's path") {
  // 400 levels of 3 children, expanding only nodes with particles; the true mass of a leaf is N 3^-400. H0: a
  // lone particle takes branch j with probability lambda_j at every level, 400 x 200 independent choices.
  const std::vector<double> lambda = {1.0 / 6, 2.0 / 3, 1.0 / 6};
  const std::uint64_t N = 50;
  ParticleMasses m;
  assign_masses(std::vector<double>{0.0}, N, m);
  for (std::uint32_t launch = 0; launch < 20; ++launch) {
    std::vector<std::uint64_t> mass(m.mass.begin(), m.mass.end()), child_mass;
    std::vector<std::uint32_t> count = {N}, child_count;
    std::vector<double> taken(3);
    double lone = 0;
    for (std::uint32_t level = 0; level < 400; ++level) {
      child_mass.resize(3 * mass.size());
      child_count.resize(3 * mass.size());
      tbba_level(mass, count, lambda, m.fraction_bits, {21, launch, level}, child_mass, child_count);
      REQUIRE(std::accumulate(child_count.begin(), child_count.end(), std::uint64_t{0}) == N);
      for (std::size_t i = 0; i < mass.size(); ++i) {
        if (count[i] != 1 || mass[i] >> m.fraction_bits != 0) continue;
        ++lone;
        for (std::size_t j = 0; j < 3; ++j) taken[j] += child_count[j * mass.size() + i];
      }
      mass.clear();
      count.clear();
      for (std::size_t i = 0; i < child_mass.size(); ++i)
        if (child_count[i] > 0) {
          mass.push_back(child_mass[i]);
          count.push_back(child_count[i]);
        }
    }
    for (std::size_t j = 0; j < 3; ++j)
      CHECK(std::abs(taken[j] / lone - lambda[j]) < bernstein_bound(lambda[j] * (1 - lambda[j]), lone, 60));
  }
}

TEST_CASE("The iterated form refuses counts that a mass does not allow") {
  std::vector<std::uint64_t> child_mass(2);
  std::vector<std::uint32_t> child_count(2);
  const std::vector<double> lambda = {0.5, 0.5};
  const auto level = [&](std::uint64_t mass, std::uint32_t count) {
    tbba_level(std::vector<std::uint64_t>{mass}, std::vector<std::uint32_t>{count}, lambda, 40, {1},
               child_mass, child_count);
  };
  const std::uint64_t one = std::uint64_t{1} << 40;
  CHECK_NOTHROW(level(2 * one + 1, 3));
  CHECK_THROWS_AS(level(2 * one, 3), InputError);
  CHECK_THROWS_AS(level(2 * one + 1, 1), InputError);
  CHECK_THROWS_AS(level(2 * one + 1, 4), InputError);
}
